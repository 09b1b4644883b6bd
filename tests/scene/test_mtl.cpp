#include <cmath>
#include <string>

#include "pathscope/math/random.hpp"
#include "pathscope/scene/mtl.hpp"

#include "testing.hpp"

using namespace pathscope;

namespace {

MtlFile mtl_of(std::string_view text) {
    auto mtl = parse_mtl(text, "a.mtl");
    REQUIRE_MESSAGE(mtl, (mtl ? "" : mtl.error().message));
    return std::move(*mtl);
}

/// The material that these statements make.
MaterialSource source_of(const std::string& statements) {
    const MtlFile mtl = mtl_of("newmtl a\n" + statements);
    REQUIRE(mtl.materials.size() == 1);
    return mtl.materials[0];
}
Material material_of(const std::string& statements) { return source_of(statements).material; }

std::string error_of(std::string_view text) {
    const auto mtl = parse_mtl(text, "a.mtl");
    return mtl ? "(no error)" : mtl.error().message;
}

}  // namespace

TEST_CASE("illum decides what kind of surface it is") {
    struct Case {
        std::string statements;
        MaterialKind kind;
    };
    const Case cases[] = {
        {"Kd 1 1 1\n", MaterialKind::standard},  {"illum 0\n", MaterialKind::lambert},
        {"illum 1\n", MaterialKind::lambert},    {"illum 2\n", MaterialKind::standard},
        {"illum 3\n", MaterialKind::standard},   {"illum 4\n", MaterialKind::thin_glass},
        {"illum 5\n", MaterialKind::mirror},     {"illum 6\n", MaterialKind::thin_glass},
        {"illum 7\n", MaterialKind::dielectric}, {"illum 8\n", MaterialKind::standard},
        {"illum 9\n", MaterialKind::dielectric}, {"illum 10\n", MaterialKind::standard},
    };
    for (const Case& c : cases) {
        CAPTURE(c.statements);
        CHECK(material_of(c.statements).kind == c.kind);
    }
}

TEST_CASE("colours and numbers are what they say, and have sane values where nothing is said") {
    const Material full =
        material_of("\tKd 0.1 0.2 0.3 # white\n Ks .4 5e-1 0.6\r\nKe 10 20 30\nNi 1.33\nd 0.25\nillum 2");
    CHECK(full.kd == Rgb{0.1f, 0.2f, 0.3f});
    CHECK(full.ks == Rgb{0.4f, 0.5f, 0.6f});
    CHECK(full.ke == Rgb{10, 20, 30});
    CHECK(full.ior == 1.33f);
    CHECK(full.opacity == 0.25f);
    CHECK(full.emits());

    const Material empty = material_of("");
    CHECK(empty.kd == Rgb{});
    CHECK(empty.ks == Rgb{});
    CHECK_FALSE(empty.emits());
    CHECK(empty.ior == 1.5f);
    CHECK(empty.opacity == 1);
    CHECK(empty.roughness == 1);
    CHECK(empty.metallic == 0);

    CHECK(material_of("Kd 0.5\n").kd == Rgb{0.5f, 0.5f, 0.5f});
    CHECK(material_of("Kd 0.5 # grey\n").kd == Rgb{0.5f, 0.5f, 0.5f});
    CHECK(material_of("Kd 0.1 0.1 0.1\nKd 1 1 1\n").kd == Rgb{1, 1, 1});  // The last one counts.
    CHECK(material_of("Ni 0\n").ior == 1.5f);
    CHECK(material_of("illum 5\n").ks == Rgb{1, 1, 1});
    CHECK(material_of("Kd 0.9 0.9 0.9\nKs 0.9 0.9 0.9\n").ks.x ==
          0.9f);  // Above 1 together: the BSDF's affair.
    CHECK(material_of("Kd 1 1 1\nTf 0.1 0.1 0.1\nKt 0 0 0\n") == material_of("Kd 1 1 1\n"));
}

TEST_CASE("d wins over Tr, before or after it") {
    CHECK(material_of("Tr 0.25\n").opacity == 0.75f);
    CHECK(material_of("d 1\nTr 0.25\n").opacity == 1);
    CHECK(material_of("Tr 0.25\nd 1\n").opacity == 1);
    CHECK(mtl_of("newmtl glass\nTr 1\n").oddities[0].find("a.mtl:2: \"glass\" is invisible") == 0);
}

TEST_CASE("roughness: Ns by alpha^2 = 2 / (Ns + 2), Pr as it is, and Pr wins") {
    for (const float ns : {0.0f, 1.0f, 10.0f, 200.0f, 10'000.0f}) {
        const float alpha = material_of("Ns " + std::to_string(ns)).roughness *
                            material_of("Ns " + std::to_string(ns)).roughness;
        CHECK(alpha * alpha == doctest::Approx(2 / (ns + 2)).epsilon(1e-5));
    }
    CHECK(material_of("Ns 0\n").roughness == 1);
    CHECK(material_of("Pr 0.3\nNs 10\n").roughness == 0.3f);
    CHECK(material_of("Ns 10\nPr 0\n").roughness == 0);
}

TEST_CASE("a material of the PBR kind that says no Ks reflects like a dielectric of its index") {
    CHECK(material_of("Kd 1 1 1\nPr 0.5\n").ks.x == doctest::Approx(0.04));
    CHECK(material_of("Kd 1 1 1\nPm 1\nNi 3\n").ks.x == doctest::Approx(0.25));
    CHECK(material_of("Kd 1 1 1\nPr 0.5\nKs 0 0 0\n").ks == Rgb{});
    CHECK(material_of("Pm 1\nKs 0.9 0.8 0.7\n").metallic == 1);
}

TEST_CASE("maps: names with blanks and folders, options before them") {
    struct Case {
        std::string line;
        MapName map;
    };
    const Case cases[] = {
        {"map_Kd a.png", {"a.png", {1, 1}, {0, 0}}},
        {"map_Kd  textures\\old wood.png \r", {"textures\\old wood.png", {1, 1}, {0, 0}}},
        {"map_Kd -s 2 3 1 a.png", {"a.png", {2, 3}, {0, 0}}},
        {"map_Kd -s 2 3 a.png", {"a.png", {2, 3}, {0, 0}}},
        {"map_Kd -s 2 a.png", {"a.png", {2, 1}, {0, 0}}},
        {"map_Kd -o 0.5 0.25 0 -s 2 2 2 my wood.png", {"my wood.png", {2, 2}, {0.5f, 0.25f}}},
        {"map_Kd -s 2 3 7", {"7", {2, 3}, {0, 0}}},
        {"map_Kd -blendu on -mm 0 1 -clamp off -imfchan l a.png", {"a.png", {1, 1}, {0, 0}}},
        {"map_Kd -texres 512 -type sphere -cc off -colorspace sRGB a.png", {"a.png", {1, 1}, {0, 0}}},
        {"map_Kd -unknown.png", {"-unknown.png", {1, 1}, {0, 0}}},
    };
    for (const Case& c : cases) {
        CAPTURE(c.line);
        CHECK(source_of(c.line).map_kd == c.map);
    }
    const MaterialSource all = source_of("map_Kd a\nmap_Ks b\nmap_Ke c\nmap_d d\nmap_Pr e\nmap_Ka f\n");
    CHECK(all.map_kd.name == "a");
    CHECK(all.map_ks.name == "b");
    CHECK(all.map_ke.name == "c");
    CHECK(all.map_d.name == "d");
    CHECK(all.map_roughness.name == "e");
}

TEST_CASE("a map without a value shows as it is") {
    CHECK(material_of("map_Kd a.png\n").kd == Rgb{1, 1, 1});
    CHECK(material_of("Kd 0.5 0.5 0.5\nmap_Kd a.png\n").kd == Rgb{0.5f, 0.5f, 0.5f});
    CHECK(material_of("map_Ks a.png\n").ks == Rgb{1, 1, 1});
    CHECK(material_of("map_Ke a.png\n").emits());
    CHECK_FALSE(material_of("map_Ke a.png\nKe 0 0 0\n").emits());
}

TEST_CASE("what would change the picture and is not used is listed") {
    const MtlFile mtl = mtl_of(
        "newmtl a\nbump -bm 0.2 b.png\nmap_bump b.png\nPs 1\nmap_Kd -clamp on -s 2 2 2 c.png\n"
        "map_Ks -blendu off -boost 1 d.png\nKa 1 1 1\nTf 1 1 1\nNe 1\nsomething else\n");
    CHECK(mtl.unused == std::set<std::string>{"bump", "map_bump", "Ps", "map_Kd -clamp", "map_Ks -blendu"});
    CHECK(mtl.oddities.empty());
}

TEST_CASE("values outside of their range are moved into it, and mentioned with their line") {
    const MtlFile mtl = mtl_of("newmtl a\nKd 1.5 -1 0.5\n");
    CHECK(mtl.materials[0].material.kd == Rgb{1, 0, 0.5f});
    REQUIRE(mtl.oddities.size() == 2);
    CHECK(mtl.oddities[0] == "a.mtl:2: Kd 1.5 is taken as 1.");
    CHECK(mtl.oddities[1] == "a.mtl:2: Kd -1 is taken as 0.");
}

TEST_CASE("names: with blanks, with trailing blanks, met twice; files from everywhere") {
    const MtlFile mtl = mtl_of(
        "\xef\xbb\xbf# made by hand\r\n\r\n  newmtl old wood \r\nKd 1 1 1\r\nnewmtl b\rKd 0.5\rnewmtl b\nKd "
        "0.1\n");
    REQUIRE(mtl.materials.size() == 3);
    CHECK(mtl.materials[0].material.name == "old wood");
    CHECK(mtl.materials[1].material.kd.x == 0.5f);
    CHECK(mtl.oddities ==
          std::vector<std::string>{"a.mtl:7: there is a material \"b\" before; this one is not used."});
    CHECK(mtl_of("").materials.empty());
}

TEST_CASE("what is wrong with an MTL is one sentence with file and line") {
    struct Case {
        std::string text, error;
    };
    const Case cases[] = {
        {"Kd 1 1 1\n", "a.mtl:1: \"Kd\" stands before any newmtl; the file is damaged."},
        {"newmtl\n", "a.mtl:1: newmtl needs a name."},
        {"newmtl a\n\nKd\n", "a.mtl:3: Kd needs a number; the file is cut off or damaged."},
        {"newmtl a\nKd 1 1\n", "a.mtl:2: Kd needs a number; the file is cut off or damaged."},
        {"newmtl a\nKd 1 one 1\n", "a.mtl:2: Kd needs a number, and \"one\" is none."},
        {"newmtl a\nKd spectral a.rfl\n", "a.mtl:2: Kd needs a number, and \"spectral\" is none."},
        {"newmtl a\nKe nan 0 0\n", "a.mtl:2: Ke needs a number, and \"nan\" is none."},
        {"newmtl a\r\nKe 1e39 0 0\r\n", "a.mtl:2: Ke needs a number, and \"1e39\" is none."},
        {"newmtl a\nNs x\n", "a.mtl:2: Ns needs a number, and \"x\" is none."},
        {"newmtl a\nillum glass\n", "a.mtl:2: illum needs a number, and \"glass\" is none."},
        {"newmtl a\nmap_Kd\n", "a.mtl:2: map_Kd names no file."},
        {"newmtl a\nmap_d -s 2 2\n", "(no error)"},
        {"newmtl a\nmap_Kd -clamp on\n", "a.mtl:2: map_Kd names no file."},
        {"newmtl a\nmap_Kd -s nan 2 2 a.png\n", "a.mtl:2: map_Kd -s needs finite numbers."},
    };
    for (const Case& c : cases) {
        CAPTURE(c.text);
        CHECK(error_of(c.text) == c.error);
    }
}

TEST_CASE("no text crashes the reader") {
    const std::string good =
        "newmtl a\nKd 1 1 1\nNs 10\nmap_Kd -s 2 2 a.png\nnewmtl b\nillum 7\nTr 0.5\nPr 0.1\n";
    HashRng rng(4);
    for (int i = 0; i < 3000; ++i) {
        std::string text = good;
        for (int k = 0; k < 4; ++k) text[rng.next_u32() % text.size()] = char(rng.next_u32());
        const auto mtl = parse_mtl(text, "a.mtl");
        if (!mtl) CHECK(mtl.error().message.starts_with("a.mtl:"));
    }
}
