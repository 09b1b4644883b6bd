/// Files of the mesh cache, behind their seal: what is read is a valid model, and the same bytes again.

#include "fuzz_target.hpp"
#include "pathscope/core/check.hpp"
#include "pathscope/scene/obj.hpp"
#include "scene/model_bytes.hpp"

namespace pathscope::fuzz {
namespace {

void read_anything(std::string_view bytes) {
    const auto model = model_from_bytes(bytes);
    if (!model) return;
    CHECK(bool(validate(model->mesh)), bytes.size());
    CHECK(model_bytes(*model) == bytes, bytes.size());
}

std::vector<std::string> seeds() {
    std::vector<std::string> seeds{model_bytes({})};
    const std::string square = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvn 0 0 1\nvt 0.5 0.5\n";
    for (const char* faces : {"f 1 2 3 4\n", "f 1/1 2/1 3/1\n", "f 1//1 2//1 3//1\n",
                              "usemtl a\nf 1/1/1 2/1/1 3/1/1 4/1/1\nusemtl b\nf 1 2 3\nf 1 1 1\n"}) {
        const auto model = parse_obj(square + faces, "a.obj", true);
        CHECK(bool(model), model.error().message);
        seeds.push_back(model_bytes(*model));
    }
    return seeds;
}

const FuzzTarget k_target{"mesh_cache", read_anything, seeds};

}  // namespace
}  // namespace pathscope::fuzz
