/// OBJ files: whatever is read is a valid mesh, and comes back from the mesh cache as it is.
///
///     bytes = smoothing text

#include "fuzz_input.hpp"
#include "fuzz_target.hpp"
#include "pathscope/core/check.hpp"
#include "pathscope/core/files.hpp"
#include "pathscope/scene/obj.hpp"
#include "scene/model_bytes.hpp"

namespace pathscope::fuzz {
namespace {

void read_anything(std::string_view bytes) {
    FuzzInput in(bytes);
    const bool smoothing = in.flag();
    const auto model = parse_obj(std::string(in.rest()), "a.obj", smoothing);
    if (!model) return CHECK(!model.error().message.empty());
    const auto valid = validate(model->mesh);
    CHECK(bool(valid), valid.error().message);
    for (std::uint32_t i = 0; i < model->mesh.triangle_count(); ++i)
        CHECK(model->mesh.material_of(i) < model->material_names.size(), i);
    const std::string cached = model_bytes(*model);
    const auto again = model_from_bytes(cached);
    CHECK(again.has_value(), cached.size());
    CHECK(model_bytes(*again) == cached, cached.size());
}

std::vector<std::string> seeds() {
    std::vector<std::string> seeds;
    for (const char* path : {"scenes/cornell/cornell.obj", "scenes/furnace/furnace.obj",
                             "scenes/furnace/white.obj", "scenes/mis_plates/mis_plates.obj"})
        if (const auto text = read_file(path); text) {
            seeds.push_back('\0' + text->substr(0, 2000));
            seeds.push_back('\1' + text->substr(0, 2000));
        }
    const std::string square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
    for (const char* rest :
         {"f 1 2 3 4\n", "f -4 -3 -2 -1\n", "vt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n",
          "vn 0 0 1\nf 1//1 2//1 3//1\nf 1//1 3//1 4//1\n", "s 1\nf 1 2 3\ns off\nf 1 3 4\n",
          "vt 0\nvn nan 0 0\nusemtl a b\nf 1/1/1 2/1/1 3/1/1 4/1/1\nusemtl\nf 1/ 2/ 3/\n",
          "f 1 2 \\\n3 4\r\n# comment\rg a\no b\nf +1 +2 +3 # c\n", "v 0.5 0.2 0\nf 1 2 3 5 4\n",
          "mtllib a.mtl b.mtl\nl 1 2\np 1\nf 1 1 1\nf 1 2 3\n",
          "v 1e30 1e-40 -1e38\nv .5 5. +3e+2 1\nf 1 5 6\nf 1 2 3\n"})
        for (const char* smoothing : {"0", "1"}) seeds.push_back(smoothing + square + rest);
    return seeds;
}

const FuzzTarget k_target{"obj", read_anything, seeds};

}  // namespace
}  // namespace pathscope::fuzz
