/// The atrium as files: OBJ, MTL and PNG.
#include <fmt/core.h>

#include <array>
#include <iterator>
#include <string>

#include "model.hpp"
#include "pathscope/core/files.hpp"
#include "picture.hpp"

namespace pathscope::atrium {
namespace {

/// A material's name, how many metres its texture spans, and its lines of the MTL.
struct StuffInfo {
    Stuff stuff;
    const char* name;
    float metres;
    const char* mtl;
};

constexpr std::array k_stuff{
    StuffInfo{Stuff::limestone, "limestone", 2,
              "Kd 1 1 1\nKs 0.04 0.04 0.04\nPr 0.8\nmap_Kd limestone.png\nillum 2\n"},
    StuffInfo{Stuff::plaster, "plaster", 4, "Kd 1 1 1\nmap_Kd plaster.png\nillum 1\n"},
    StuffInfo{Stuff::marble, "marble", 2,
              "Kd 1 1 1\nKs 0.04 0.04 0.04\nPr 0.4\nmap_Kd marble.png\nillum 2\n"},
    StuffInfo{Stuff::flagstone, "flagstone", 4,
              "Kd 1 1 1\nKs 0.04 0.04 0.04\nPr 0.45\nmap_Kd flagstone.png\nillum 2\n"},
    StuffInfo{Stuff::inlay, "inlay", 2, "Kd 1 1 1\nKs 0.05 0.05 0.05\nPr 0.18\nmap_Kd inlay.png\nillum 2\n"},
    StuffInfo{Stuff::terracotta, "terracotta", 1,
              "Kd 1 1 1\nKs 0.04 0.04 0.04\nPr 0.7\nmap_Kd terracotta.png\nillum 2\n"},
    StuffInfo{Stuff::oak, "oak", 1, "Kd 1 1 1\nKs 0.04 0.04 0.04\nPr 0.5\nmap_Kd oak.png\nillum 2\n"},
    StuffInfo{Stuff::iron_grille, "iron_grille", 1,
              "Kd 0.03 0.03 0.03\nKs 0.1 0.1 0.1\nPr 0.5\nmap_d grille_mask.png\nillum 2\n"},
    StuffInfo{Stuff::grass, "grass", 3, "Kd 0.5 0.5 0.5\nmap_Kd leaves.png\nillum 1\n"},
    StuffInfo{Stuff::bronze, "bronze", 1, "Kd 0 0 0\nKs 0.68 0.43 0.22\nPr 0.3\nPm 1\nillum 3\n"},
    StuffInfo{Stuff::brass, "brass", 1, "Kd 0 0 0\nKs 0.89 0.68 0.33\nPr 0.2\nPm 1\nillum 3\n"},
    StuffInfo{Stuff::glaze, "glaze", 1, "Kd 0.02 0.09 0.26\nKs 0.05 0.05 0.05\nPr 0.1\nillum 2\n"},
    StuffInfo{Stuff::mirror, "mirror", 1, "Kd 0 0 0\nKs 0.95 0.95 0.95\nillum 5\n"},
    StuffInfo{Stuff::glass, "glass", 1, "Kd 0 0 0\nKs 1 1 1\nNi 1.5\nillum 7\n"},
    StuffInfo{Stuff::water, "water", 1, "Kd 0 0 0\nKs 1 1 1\nNi 1.33\nillum 7\n"},
    StuffInfo{Stuff::banner_red, "banner_red", 1, "Kd 1 1 1\nmap_Kd banner_red.png\nillum 1\n"},
    StuffInfo{Stuff::banner_blue, "banner_blue", 1, "Kd 1 1 1\nmap_Kd banner_blue.png\nillum 1\n"},
    StuffInfo{Stuff::leaf, "leaf", 1,
              "Kd 1 1 1\nKs 0.04 0.04 0.04\nPr 0.5\nmap_Kd leaves.png\nmap_d leaf_mask.png\nillum 2\n"},
    StuffInfo{Stuff::ivy, "ivy", 1,
              "Kd 0.8 0.9 0.8\nKs 0.04 0.04 0.04\nPr 0.5\nmap_Kd leaves.png\nmap_d ivy_mask.png\nillum 2\n"},
    StuffInfo{Stuff::bark, "bark", 1, "Kd 0.12 0.09 0.06\nillum 1\n"},
    StuffInfo{Stuff::soil, "soil", 1, "Kd 0.06 0.04 0.03\nillum 1\n"},
};

const StuffInfo& info(Stuff stuff) { return k_stuff[std::size_t(stuff)]; }

void write_part(std::string& text, const StuffInfo& stuff, const Shape& shape, std::size_t first) {
    auto out = std::back_inserter(text);
    fmt::format_to(out, "o {0}\nusemtl {0}\n", stuff.name);
    for (const Vertex& v : shape.vertices)
        fmt::format_to(out, "v {:.5g} {:.5g} {:.5g}\n", v.position.x, v.position.y, v.position.z);
    for (const Vertex& v : shape.vertices)
        fmt::format_to(out, "vt {:.5g} {:.5g}\n", v.uv.x / stuff.metres, v.uv.y / stuff.metres);
    for (const Vertex& v : shape.vertices)
        fmt::format_to(out, "vn {:.4f} {:.4f} {:.4f}\n", v.normal.x, v.normal.y, v.normal.z);
    for (const auto& t : shape.triangles)
        fmt::format_to(out, "f {0}/{0}/{0} {1}/{1}/{1} {2}/{2}/{2}\n", t[0] + first, t[1] + first,
                       t[2] + first);
}

std::string mtl_text() {
    std::string text =
        "# Made by make-atrium. Ks is the reflectance at normal incidence, Pr the roughness.\n";
    for (const StuffInfo& stuff : k_stuff) text += fmt::format("\nnewmtl {}\n{}", stuff.name, stuff.mtl);
    return text;
}

}  // namespace

std::size_t Model::triangles() const {
    std::size_t count = 0;
    for (const auto& [stuff, shape] : parts) count += shape.triangles.size();
    return count;
}

Result<void> write_model(const Model& model, const std::filesystem::path& folder) {
    std::string text =
        "# Made by make-atrium: a courtyard with two floors of arcades. Metres, y up.\nmtllib atrium.mtl\n";
    std::size_t first = 1;  // OBJ counts from one, over all parts
    for (const auto& [stuff, shape] : model.parts) {
        write_part(text, info(stuff), shape, first);
        first += shape.vertices.size();
    }
    if (const auto done = write_file_atomically(folder / "atrium.obj", text); !done) return done;
    return write_file_atomically(folder / "atrium.mtl", mtl_text());
}

Result<void> write_textures(const std::filesystem::path& folder) {
    struct Texture {
        const char* file;
        int width, height;
        PictureKind kind;
        std::function<Rgb(Vec2)> colour;
    };
    const auto mask = [](float (*inside)(Vec2)) { return [inside](Vec2 p) { return Rgb{inside(p), 0, 0}; }; };
    const Rgb crimson{0.40f, 0.02f, 0.025f}, gold{0.72f, 0.48f, 0.12f}, navy{0.02f, 0.06f, 0.24f},
        silver{0.62f, 0.62f, 0.60f};
    const std::array textures{
        Texture{"limestone.png", 1024, 1024, PictureKind::colour, limestone_blocks},
        Texture{"plaster.png", 1024, 1024, PictureKind::colour, ochre_plaster},
        Texture{"marble.png", 1024, 1024, PictureKind::colour, veined_marble},
        Texture{"flagstone.png", 1024, 1024, PictureKind::colour, flagstones},
        Texture{"inlay.png", 1024, 1024, PictureKind::colour, inlaid_floor},
        Texture{"terracotta.png", 256, 256, PictureKind::colour, terracotta},
        Texture{"oak.png", 512, 512, PictureKind::colour, oak},
        Texture{"leaves.png", 256, 256, PictureKind::colour, leaves},
        Texture{"banner_red.png", 512, 1024, PictureKind::colour,
                [=](Vec2 p) { return damask(p, crimson, gold); }},
        Texture{"banner_blue.png", 512, 1024, PictureKind::colour,
                [=](Vec2 p) { return damask(p, navy, silver); }},
        Texture{"leaf_mask.png", 256, 256, PictureKind::mask, mask(leaf_mask)},
        Texture{"ivy_mask.png", 128, 128, PictureKind::mask, mask(ivy_mask)},
        Texture{"grille_mask.png", 512, 512, PictureKind::mask, mask(grille_mask)},
    };
    for (const Texture& t : textures)
        if (const auto done = write_png(folder / t.file, paint(t.width, t.height, t.colour), t.kind); !done)
            return done;
    return {};
}

}  // namespace pathscope::atrium
