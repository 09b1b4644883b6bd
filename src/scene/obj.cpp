#include "pathscope/scene/obj.hpp"

#include <fmt/format.h>
#include <tiny_obj_loader.h>

#include <algorithm>
#include <map>
#include <sstream>
#include <utility>

#include "obj_check.hpp"
#include "pathscope/core/check.hpp"
#include "pathscope/scene/triangulate.hpp"
#include "smooth_normals.hpp"
#include "text_scan.hpp"

namespace pathscope {
namespace {

/// Collects what tinyobjloader calls out, line by line.
struct Collector {
    ObjFaces faces;
    std::vector<std::string> material_names;
    std::string current_material;
    bool material_is_new = true;

    void add_face(const tinyobj::index_t* indices, int count) {
        for (int i = 0; i < count; ++i) {
            if (indices[i].vertex_index == 0) break;  // A comment behind the corners.
            faces.corners.push_back({absolute(indices[i].vertex_index, faces.positions.size()),
                                     absolute(indices[i].texcoord_index, faces.uvs.size()),
                                     absolute(indices[i].normal_index, faces.normals.size())});
        }
        faces.first_corner.push_back(std::uint32_t(faces.corners.size()));
        faces.material.push_back(material());
    }

  private:
    /// OBJ counts from 1, or backwards from what has been read so far.
    static std::int32_t absolute(int index, std::size_t count) {
        return index > 0 ? index - 1 : index < 0 ? std::int32_t(count) + index : k_none;
    }

    std::uint32_t material() {
        if (std::exchange(material_is_new, false)) {
            const auto [entry, is_new] = numbers_.try_emplace(current_material, material_names.size());
            if (is_new) material_names.push_back(current_material);
            current_ = std::uint32_t(entry->second);
        }
        return current_;
    }

    std::map<std::string, std::size_t> numbers_;
    std::uint32_t current_ = 0;
};

Collector& collector(void* data) { return *static_cast<Collector*>(data); }

/// Requires: check_obj accepts the text.
Collector collect(std::string text, const ObjOutline& outline) {
    Collector all;
    all.faces.positions.reserve(outline.positions);
    all.faces.normals.reserve(outline.normals);
    all.faces.uvs.reserve(outline.uvs);
    all.faces.corners.reserve(outline.corners);
    all.faces.first_corner.reserve(outline.faces + 1);
    all.faces.first_corner.push_back(0);
    all.faces.material.reserve(outline.faces);

    tinyobj::callback_t calls;
    calls.vertex_cb = [](void* data, float x, float y, float z, float) {
        collector(data).faces.positions.push_back({x, y, z});
    };
    calls.normal_cb = [](void* data, float x, float y, float z) {
        collector(data).faces.normals.push_back({x, y, z});
    };
    calls.texcoord_cb = [](void* data, float u, float v, float) {
        collector(data).faces.uvs.push_back({u, v});
    };
    calls.index_cb = [](void* data, tinyobj::index_t* indices, int count) {
        collector(data).add_face(indices, count);
    };
    calls.usemtl_cb = [](void* data, const char* name, int) {
        collector(data).current_material = rest_of(name);
        collector(data).material_is_new = true;
    };
    std::istringstream stream(std::move(text));
    std::string warnings, errors;
    tinyobj::LoadObjWithCallback(stream, calls, &all, nullptr, &warnings, &errors);
    CHECK(all.faces.positions.size() == outline.positions && all.faces.normals.size() == outline.normals &&
              all.faces.uvs.size() == outline.uvs && all.faces.size() == outline.faces &&
              all.faces.corners.size() == outline.corners,
          errors);
    return all;
}

void set_groups(ObjFaces& faces, const std::vector<SmoothingRun>& runs) {
    for (std::size_t i = 0; i < runs.size(); ++i) {
        const std::size_t end = i + 1 < runs.size() ? runs[i + 1].first_face : faces.size();
        faces.group.resize(end, runs[i].group);
    }
}

/// Corners that share position, uv and normal share a vertex: each position heads a chain of its vertices.
class VertexTable {
  public:
    VertexTable(const ObjFaces& faces, Mesh& mesh)
        : faces_(faces), mesh_(mesh), head_(faces.positions.size(), k_none) {
        has_uvs_ = std::any_of(faces.corners.begin(), faces.corners.end(),
                               [](const ObjCorner& corner) { return corner.uv != k_none; });
        has_normals_ = std::any_of(faces.corners.begin(), faces.corners.end(), [&](const ObjCorner& corner) {
            return corner.normal != k_none && !is_zero(faces.normals[std::size_t(corner.normal)]);
        });
    }

    std::uint32_t vertex_of(const ObjCorner& corner) {
        std::int32_t& head = head_[std::size_t(corner.position)];
        for (std::int32_t i = head; i != k_none; i = entries_[std::size_t(i)].next)
            if (entries_[std::size_t(i)].uv == corner.uv && entries_[std::size_t(i)].normal == corner.normal)
                return std::uint32_t(i);
        entries_.push_back({corner.uv, corner.normal, head});
        mesh_.positions.push_back(faces_.positions[std::size_t(corner.position)]);
        if (has_uvs_) mesh_.uvs.push_back(corner.uv == k_none ? Vec2{} : faces_.uvs[std::size_t(corner.uv)]);
        if (has_normals_)
            mesh_.normals.push_back(corner.normal == k_none ? Vec3{}
                                                            : faces_.normals[std::size_t(corner.normal)]);
        head = std::int32_t(entries_.size() - 1);
        return std::uint32_t(head);
    }

  private:
    struct Entry {
        std::int32_t uv, normal, next;
    };
    const ObjFaces& faces_;
    Mesh& mesh_;
    std::vector<std::int32_t> head_;
    std::vector<Entry> entries_;
    bool has_uvs_ = false, has_normals_ = false;
};

/// Cuts every face into triangles; returns how many were left out because they have no area.
std::size_t build_mesh(ObjFaces& faces, Mesh& mesh) {
    VertexTable vertices(faces, mesh);
    const std::size_t most_triangles = faces.corners.size() - 2 * faces.size();
    mesh.triangles.reserve(most_triangles);
    mesh.materials.reserve(most_triangles);
    std::vector<Vec3> polygon;
    std::vector<std::uint32_t> cut;
    std::size_t degenerate = 0;
    for (std::size_t face = 0; face < faces.size(); ++face) {
        const std::span<const ObjCorner> corners = faces.corners_of(face);
        polygon.clear();
        for (const ObjCorner& corner : corners)
            polygon.push_back(faces.positions[std::size_t(corner.position)]);
        cut.clear();
        triangulate(polygon, cut);
        for (std::size_t i = 0; i < cut.size(); i += 3) {
            if (is_degenerate({polygon[cut[i]], polygon[cut[i + 1]], polygon[cut[i + 2]]})) {
                ++degenerate;
                continue;
            }
            mesh.triangles.push_back({vertices.vertex_of(corners[cut[i]]),
                                      vertices.vertex_of(corners[cut[i + 1]]),
                                      vertices.vertex_of(corners[cut[i + 2]])});
            mesh.materials.push_back(faces.material[face]);
        }
    }
    return degenerate;
}

}  // namespace

Result<ObjModel> parse_obj(std::string text, const std::string& shown_path, bool smoothing) {
    if (text.starts_with("\xef\xbb\xbf")) text.replace(0, 3, 3, ' ');  // A byte order mark of UTF-8.
    const std::vector<std::size_t> joined = join_continued_lines(text);
    Result<ObjOutline> outline = check_obj(text, joined, shown_path);
    if (!outline) return outline.error();

    Collector all = collect(std::move(text), *outline);
    for (const std::uint32_t normal : outline->not_finite_normals) all.faces.normals[normal] = {};
    set_groups(all.faces, outline->smoothing);
    if (smoothing) add_smooth_normals(all.faces);

    ObjModel model;
    model.material_names = std::move(all.material_names);
    model.material_files = std::move(outline->material_files);
    model.degenerate_triangles = build_mesh(all.faces, model.mesh);
    return model;
}

}  // namespace pathscope
