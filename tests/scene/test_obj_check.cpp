#include <string>

#include "pathscope/math/random.hpp"
#include "pathscope/scene/obj.hpp"

#include "testing.hpp"

using namespace pathscope;

namespace {

const std::string k_positions = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

std::string error_of(std::string text) {
    const auto model = parse_obj(std::move(text), "a.obj", true);
    return model ? "(no error)" : model.error().message;
}

}  // namespace

TEST_CASE("what is wrong with an OBJ is one sentence with file and line") {
    struct Case {
        std::string text, error;
    };
    const Case cases[] = {
        {"", "a.obj has no faces"},
        {k_positions, "a.obj has no faces"},
        {std::string("PNG\r\n\x1a\n\0\0", 9), "a.obj:3: is no text from here on"},
        {"v 0 0\n", "a.obj:1: \"v\" needs 3 numbers and has 2; the file is cut off"},
        {"v 0 0 # 0\n", "a.obj:1: \"#\" is not a number."},
        {"v\n", "a.obj:1: \"v\" needs 3 numbers and has 0"},
        {k_positions + "vt\n", "a.obj:5: \"vt\" needs 1 number and has 0"},
        {k_positions + "vn 0 1", "a.obj:5: \"vn\" needs 3 numbers and has 2"},
        {"v 0 zero 0\n", "a.obj:1: \"zero\" is not a number."},
        {"v 0 1,5 0\n", "a.obj:1: \"1,5\" is not a number."},
        {"v 0 1e 0\n", "a.obj:1: \"1e\" is not a number."},
        {"v 0 0x10 0\n", "a.obj:1: \"0x10\" is not a number."},
        {"v 0 +-1 0\n", "a.obj:1: \"+-1\" is not a number."},
        {"v 0 0 0\n\n# x\n\nv 0 nan 0\n", "a.obj:5: \"nan\" is not a finite number"},
        {"v 0 0 0\r\n\r\nv 0 0 -inf\r\n", "a.obj:3: \"-inf\" is not a finite number"},
        {"v 0 0 0\r\rv 0 0 1e39\r", "a.obj:3: \"1e39\" is not a finite number"},
        {"v 0 0 1e999\n", "a.obj:1: \"1e999\" is not a finite number"},
        {"v 0 0 0e999\n", "a.obj:1: \"0e999\" has a larger exponent than is read"},
        {"v 0 0 0\nvn 0 0E+301 1\n", "a.obj:2: \"0E+301\" has a larger exponent than is read"},
        {k_positions + "vt nan 0\n", "a.obj:5: \"nan\" is not a finite number"},
        {k_positions + "vn 0 x 0\n", "a.obj:5: \"x\" is not a number"},
        {k_positions + "f 1 2 3\nf 1 2\n", "a.obj:6: a face needs at least three corners and has 2"},
        {k_positions + "f\n", "a.obj:5: a face needs at least three corners and has 0"},
        {k_positions + "f 1 2 5\nf 1 2 3\n",
         "a.obj:5: a face has the vertex index 5, but the file has only 4 \"v\" lines."},
        {k_positions + "f 1/1 2/1 3/1\n",
         "a.obj:5: a face has the texture index 1, but the file has only 0 \"vt\" lines."},
        {k_positions + "vn 0 0 1\nf 1//1 2//1 3//2\n",
         "a.obj:6: a face has the normal index 2, but the file has only 1"},
        {k_positions + "f 1 2 -5\n",
         "a.obj:5: a face has the vertex index -5, but only 4 \"v\" lines come before it."},
        {"f -1 -1 -1\n" + k_positions, "a.obj:1: a face has the vertex index -1, but only 0"},
        {k_positions + "f 0 1 2\n", "a.obj:5: a face has the index 0; indices start at 1."},
        {k_positions + "f 1/0 1 2\n", "a.obj:5: a face has the index 0"},
        {k_positions + "f 1 2 99999999999999999999\n",
         "a.obj:5: a face has the vertex index 9223372036854775807"},
        {k_positions + "f 1 2 -99999999999999999999\n", "a.obj:5: a face has the"},
        {k_positions + "f 1 2 x\n", "a.obj:5: \"x\" is not a corner; write a face as"},
        {k_positions + "f 1 2 +-1\n", "a.obj:5: \"+-1\" is not a corner"},
        {k_positions + "f 1 2 3.5\n", "a.obj:5: \"3.5\" is not a corner"},
        {k_positions + "f 1 2 /3\n", "a.obj:5: \"/3\" is not a corner"},
        {k_positions + "f 1/1/1/1 2 3\n", "a.obj:5: \"1/1/1/1\" is not a corner"},
        {k_positions + "f 1 \\\n 2 \\\n 3\n\nf 1 2 8\n", "a.obj:9: a face has the vertex index 8"},
        {k_positions + "f 1 2 \\\r\n x\r\n", "a.obj:5: \"x\" is not a corner"},
    };
    for (const Case& c : cases) {
        CAPTURE(c.text);
        CAPTURE(error_of(c.text));
        CHECK(error_of(c.text).starts_with(c.error));
        CHECK(error_of(c.text).ends_with("."));
    }
}

TEST_CASE("an OBJ that is cut off anywhere is either right or an error with its line") {
    const std::string text = "mtllib a.mtl\n" + k_positions +
                             "vt 0.5 0.5\nvn 0 0 1\nusemtl wood\ns 1\n"
                             "f 1/1/1 2/1/1 3/1/1\nf 1/1/1 3/1/1 4/1/1\n";
    for (std::size_t length = 0; length <= text.size(); ++length) {
        const auto model = parse_obj(text.substr(0, length), "a.obj", true);
        if (model)
            CHECK(validate(model->mesh));
        else
            CHECK(model.error().message.starts_with("a.obj"));
    }
}

TEST_CASE("no text crashes the reader") {
    const std::string good = "mtllib a.mtl\n" + k_positions +
                             "vt 0.5 0.5\nvn 0 0 1\nusemtl wood\ns 1\n"
                             "f 1/1/1 2/1/1 3/1/1\nf -4//1 -2//1 -1//1 \\\n 2//1\n";
    HashRng rng(9);
    const std::string alphabet = "0123456789 \t\n\r\\/-+.eEvnfts#inax";
    for (int i = 0; i < 5000; ++i) {
        std::string text = good;
        for (int k = 0; k < 4; ++k)
            text[rng.next_u32() % text.size()] =
                i % 2 ? alphabet[rng.next_u32() % alphabet.size()] : char(rng.next_u32());
        const auto model = parse_obj(text, "a.obj", true);
        if (model) CHECK(validate(model->mesh));
    }
}
