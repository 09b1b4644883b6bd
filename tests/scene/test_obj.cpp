#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include "pathscope/core/files.hpp"
#include "pathscope/scene/obj.hpp"

#include "testing.hpp"

using namespace pathscope;

namespace {

ObjModel model_of(std::string text, bool smoothing = true) {
    auto model = parse_obj(std::move(text), "a.obj", smoothing);
    REQUIRE_MESSAGE(model, (model ? "" : model.error().message));
    const auto valid = validate(model->mesh);
    REQUIRE_MESSAGE(valid, (valid ? "" : valid.error().message));
    return std::move(*model);
}

double total_area(const Mesh& mesh) {
    double sum = 0;
    for (std::uint32_t i = 0; i < mesh.triangle_count(); ++i) sum += area(corners(mesh, i));
    return sum;
}

/// The normal of a vertex of triangle `triangle` that lies at `position`.
Vec3 normal_at(const Mesh& mesh, std::uint32_t triangle, Vec3 position) {
    const TriangleIndices& t = mesh.triangles[triangle];
    for (const std::uint32_t vertex : {t.a, t.b, t.c})
        if (mesh.positions[vertex] == position) return mesh.normals[vertex];
    FAIL("the triangle has no such corner");
    return {};
}

const std::string k_square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

/// Two unit squares that meet at a right angle along the y axis: one in z = 0, one in x = 0.
std::string corner_of_a_box(const std::string& smoothing) {
    return "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 0 1 1\n" + smoothing + "f 1 2 3 4\nf 1 4 6 5\n";
}

}  // namespace

TEST_CASE("a face is a face, however it is written") {
    for (const std::string& text : {
             k_square + "f 1 2 3 4\n",
             "\xef\xbb\xbf" + k_square + "f 1 2 3 4\n",
             k_square + "f -4 -3 -2 -1",
             k_square + "f 1 2 -2 +4\r\n",
             std::string("v 0 0 0\r\nv 1 0 0\r\nv 1 1 0\r\nv 0 1 0\r\nf 1 2 3 4\r\n"),
             std::string("v 0 0 0\rv 1 0 0\rv 1 1 0\rv 0 1 0\rf 1 2 3 4\r"),
             std::string("f 1 2 3 4\n") + k_square,
             k_square + "vt 0 0\nvn 0 0 1\nf 1/1/1 2/1/1 3/1/1 4/1/1\n",
             k_square + "vt 0\nf 1/1 2/1 3/1 4/1\n",
             k_square + "vn 0 0 1\nf 1//1 2//1 3//1 4//1\n",
             k_square + "f 1// 2/ 3 4//\n",
             k_square + "f 1 2 \\\n 3 4\n",
             k_square + "f 1 2\\\r\n 3 4\n",
             k_square + "\t f\t1  2 3 4 \t # a comment/with/slashes 1 2\n",
             std::string("v 0 0 0 1.0\nv 1.0 0e0 -0\nv +1 1. .0 0.5 0.5 0.5\nv 0 1E0 0 # corner\nf 1 2 3 4"),
             k_square + "# f 9 9 9\ng group one\no object\nl 1 2\np 1\nfoo bar\nf 1 2 3 4\n",
         }) {
        CAPTURE(text);
        const ObjModel model = model_of(text);
        CHECK(model.mesh.triangles.size() == 2);
        CHECK(model.mesh.positions.size() == 4);
        CHECK(total_area(model.mesh) == doctest::Approx(1));
        CHECK(geometric_normal(corners(model.mesh, 0)) == Vec3{0, 0, 1});
    }
}

TEST_CASE("corners that share position, uv and normal share a vertex; others do not") {
    const std::string two_triangles = "f 1/1/1 2/1/1 3/1/1\nf 1/1/1 3/1/1 4/1/1\n";
    CHECK(model_of(k_square + "vt 0 0\nvn 0 0 1\n" + two_triangles).mesh.positions.size() == 4);
    CHECK(model_of(k_square + "vt 0 0\nvt 1 1\nf 1/1 2/1 3/1\nf 1/2 3/1 4/1\n").mesh.positions.size() == 5);
    CHECK(model_of(k_square + "vn 0 0 1\nvn 0 1 0\nf 1//1 2//1 3//1\nf 1//1 3//2 4//1\n")
              .mesh.positions.size() == 5);
    CHECK(model_of(k_square + "v 7 7 7\nf 1 2 3").mesh.positions.size() == 3);  // Unused ones go.
}

TEST_CASE("uvs and normals come with their vertices, zeros where there are none") {
    const Mesh mesh = model_of(k_square + "vt 0.25 0.75 9\nvn 0 0 2\nf 1/1/1 2/1/1 3/1/1\nf 1 3 4\n").mesh;
    REQUIRE(mesh.uvs.size() == mesh.positions.size());
    REQUIRE(mesh.normals.size() == mesh.positions.size());
    CHECK(mesh.uvs[mesh.triangles[0].b] == Vec2{0.25f, 0.75f});
    CHECK(mesh.normals[mesh.triangles[0].b] == Vec3{0, 0, 2});
    CHECK(mesh.uvs[mesh.triangles[1].c] == Vec2{});
    CHECK(mesh.normals[mesh.triangles[1].c] == Vec3{});
    const Mesh bare = model_of(k_square + "f 1 2 3").mesh;
    CHECK(bare.uvs.empty());
    CHECK(bare.normals.empty());
}

TEST_CASE("normals that are zero or not finite mean flat") {
    const Mesh mesh = model_of(k_square +
                               "vn 0 0 0\nvn nan 1 0\nvn 0 1 inf\nvn 0 1 0\n"
                               "f 1//1 2//2 3//3\nf 1//4 3//4 4//4\n")
                          .mesh;
    CHECK(normal_at(mesh, 0, {0, 0, 0}) == Vec3{});
    CHECK(normal_at(mesh, 0, {1, 0, 0}) == Vec3{});
    CHECK(normal_at(mesh, 0, {1, 1, 0}) == Vec3{});
    CHECK(normal_at(mesh, 1, {1, 1, 0}) == Vec3{0, 1, 0});
    CHECK(model_of(k_square + "vn 0 0 0\nf 1//1 2//1 3//1").mesh.normals.empty());
}

TEST_CASE("materials are named in order of use, before any usemtl as the empty name") {
    const ObjModel model = model_of("mtllib a b.mtl\n" + k_square +
                                    "f 1 2 3\nusemtl unused\nusemtl old wood  \r\nf 1 2 3 4\nusemtl b\n"
                                    "g x\nf 1 2 3\nusemtl old wood\nf 2 3 4\nmtllib sub\\c.mtl\n");
    CHECK(model.material_names == std::vector<std::string>{"", "old wood", "b"});
    CHECK(model.mesh.materials == std::vector<std::uint32_t>{0, 1, 1, 2, 1});
    CHECK(model.material_files == std::vector<std::string>{"a b.mtl", "sub\\c.mtl"});
}

TEST_CASE("triangles without area are left out and counted") {
    const ObjModel model = model_of(k_square + "v 2 0 0\nf 1 2 3\nf 1 2 5\nf 1 1 2\nf 3 3 3\nf 1 2 5 3\n");
    CHECK(model.degenerate_triangles == 3);
    CHECK(total_area(model.mesh) == doctest::Approx(0.5 + 1));
}

TEST_CASE("without normals, faces of a smoothing group share their mean, others stay flat") {
    const float h = std::sqrt(0.5f);
    for (const char* group : {"s 1\n", "s 7\n", "s on\n"}) {
        const Mesh mesh = model_of(corner_of_a_box(group)).mesh;
        for (const std::uint32_t triangle : {0u, 1u})
            if (mesh.triangles[triangle].a == 0)
                CHECK(length(normal_at(mesh, triangle, {0, 0, 0}) - Vec3{h, 0, h}) < 1e-6f);
        CHECK(length(normal_at(mesh, 0, {1, 0, 0}) - Vec3{0, 0, 1}) < 1e-6f);
        CHECK(mesh.positions.size() == 6);
    }
    for (const char* off : {"", "s off\n", "s 0\n", "s\n"})
        CHECK(model_of(corner_of_a_box(off)).mesh.normals.empty());
    CHECK(model_of(corner_of_a_box("s 1\n"), false).mesh.normals.empty());

    // Different groups do not mix, and a group may come back.
    const Mesh two = model_of(
                         "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 0 1 1\n"
                         "s 1\nf 1 2 3\ns 2\nf 1 4 6 5\ns 1\nf 1 3 4\n")
                         .mesh;
    CHECK(length(normal_at(two, 0, {0, 0, 0}) - Vec3{0, 0, 1}) < 1e-6f);
    CHECK(length(normal_at(two, 1, {0, 0, 0}) - Vec3{1, 0, 0}) < 1e-6f);
    CHECK(two.triangles.back().a == two.triangles[0].a);
}

TEST_CASE("a mean normal does not depend on how the faces are cut") {
    // The corner of a cube, one face as a quad, the next as two triangles, the third as a quad cut the other way.
    const Mesh mesh = model_of(
                          "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 1 1 0\nv 0 1 1\nv 1 0 1\ns 1\n"
                          "f 1 3 5 2\nf 1 4 6\nf 1 6 3\nf 4 1 2\nf 4 2 7\n")
                          .mesh;
    const float third = -1 / std::sqrt(3.0f);
    for (const std::uint32_t triangle : {2u, 3u, 4u})
        CHECK(length(normal_at(mesh, triangle, {0, 0, 0}) - Vec3{third, third, third}) < 1e-6f);
}

TEST_CASE("given normals stand, also in a smoothing group; faces beside them that lack them are smoothed") {
    const Mesh mesh = model_of(
                          "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvn 0 1 0\ns 1\n"
                          "f 1//1 2//1 3//1\nf 1 3 4\n")
                          .mesh;
    CHECK(normal_at(mesh, 0, {0, 0, 0}) == Vec3{0, 1, 0});
    const float h = std::sqrt(0.5f);
    CHECK(length(normal_at(mesh, 1, {0, 0, 0}) - Vec3{h, 0, h}) < 1e-6f);
}

TEST_CASE("the faces of a real scene are cut into triangles that add up to them") {
    const auto folder = testing::shared_folder();
    if (folder.empty()) {
        MESSAGE("skipped: no ../shared");
        return;
    }
    const auto text = read_file(folder / "scenes/dabrovic_sponza/sponza.obj");
    REQUIRE(text);
    const ObjModel model = model_of(*text, false);
    CHECK(model.mesh.triangles.size() + model.degenerate_triangles == 66'450);

    // The same areas by material, from the polygons as they stand in the file, without triangles.
    std::vector<Vec3> positions;
    std::map<std::string, double> polygon_area;
    std::string material;
    std::size_t largest_face = 0;
    std::istringstream lines(*text);
    for (std::string line, word; std::getline(lines, line);) {
        std::istringstream words(line);
        words >> word;
        if (word == "v") {
            Vec3 p;
            words >> p.x >> p.y >> p.z;
            positions.push_back(p);
        } else if (word == "usemtl") {
            words >> material;
        } else if (word == "f") {
            std::vector<Vec3> face;
            for (int index = 0; words >> word;) {
                index = std::stoi(word);
                face.push_back(positions[std::size_t(index > 0 ? index - 1 : int(positions.size()) + index)]);
            }
            largest_face = std::max(largest_face, face.size());
            Vec3 sum;
            for (std::size_t i = 2; i < face.size(); ++i)
                sum += cross(face[i - 1] - face[0], face[i] - face[0]);
            polygon_area[material] += double(length(sum)) / 2;
        }
        word.clear();
    }
    CHECK(largest_face == 4);
    std::map<std::string, double> triangle_area;
    for (std::uint32_t i = 0; i < model.mesh.triangle_count(); ++i)
        triangle_area[model.material_names[model.mesh.material_of(i)]] += area(corners(model.mesh, i));
    // Bent quads have more area as two triangles than as one polygon: a thousandth over a whole material.
    for (const auto& [name, expected] : polygon_area) {
        CAPTURE(name);
        CHECK(triangle_area[name] == doctest::Approx(expected).epsilon(0.001));
    }
}
