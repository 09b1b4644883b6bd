/// MTL files: every material that is read has values that a scene may have.

#include <cmath>

#include "fuzz_target.hpp"
#include "pathscope/core/check.hpp"
#include "pathscope/core/files.hpp"
#include "pathscope/scene/mtl.hpp"

namespace pathscope::fuzz {
namespace {

bool is_light(Rgb colour) {
    const auto fine = [](float x) { return std::isfinite(x) && x >= 0; };
    return fine(colour.x) && fine(colour.y) && fine(colour.z);
}

void read_anything(std::string_view bytes) {
    const auto file = parse_mtl(bytes, "a.mtl");
    if (!file) return CHECK(!file.error().message.empty());
    for (const MaterialSource& source : file->materials) {
        const Material& material = source.material;
        CHECK(is_light(material.kd) && is_light(material.ks) && is_light(material.ke), material.name);
        CHECK(material.roughness >= 0 && material.roughness <= 1, material.roughness);
        CHECK(material.opacity >= 0 && material.opacity <= 1, material.opacity);
        CHECK(std::isfinite(material.ior) && material.ior > 0, material.ior);
    }
}

std::vector<std::string> seeds() {
    std::vector<std::string> seeds;
    for (const char* path : {"scenes/cornell/cornell.mtl", "scenes/furnace/furnace.mtl",
                             "scenes/furnace/white.mtl", "scenes/mis_plates/mis_plates.mtl"})
        if (auto text = read_file(path); text && text->size() <= 4096) seeds.push_back(std::move(*text));
    for (const char* statement : {"Kd 0.5",
                                  "Kd xyz 1 2 3",
                                  "Kd spectral a.rfl",
                                  "Ks 1 1 1",
                                  "Ke 10 10 10",
                                  "Ns 900",
                                  "Ni 1.5",
                                  "d 0.5",
                                  "d -halo 0.5",
                                  "Tr 0.5",
                                  "Tf 1 1 1",
                                  "illum 5",
                                  "Pr 0",
                                  "Pm 1",
                                  "map_Kd a b.png",
                                  "map_Kd -s 2 2 -o 0.5 0.5 0 -clamp on a.png",
                                  "map_d -imfchan m \"a.png\"",
                                  "map_Ke e.png",
                                  "map_Pr r.png",
                                  "bump -bm 1 b.png",
                                  "Kd nan inf 1e999",
                                  "Kd\t1 \\\n 0 0"})
        seeds.push_back("newmtl a\n" + std::string(statement) + "\nnewmtl b\r\nKd 1 1 1\n");
    return seeds;
}

const FuzzTarget k_target{"mtl", read_anything, seeds};

}  // namespace
}  // namespace pathscope::fuzz
