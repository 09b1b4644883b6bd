#include "model_bytes.hpp"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <type_traits>
#include <vector>

namespace pathscope {
namespace {

class Writer {
  public:
    explicit Writer(std::size_t bytes) { bytes_.reserve(bytes); }

    void number(std::uint64_t value) { raw(&value, sizeof value); }
    void names(const std::vector<std::string>& names) {
        number(names.size());
        for (const std::string& name : names) {
            number(name.size());
            raw(name.data(), name.size());
        }
    }
    template <class Element>
    void array(const std::vector<Element>& elements) {
        static_assert(std::is_trivially_copyable_v<Element> && sizeof(Element) % 4 == 0, "without padding");
        number(elements.size());
        raw(elements.data(), elements.size() * sizeof(Element));
    }
    [[nodiscard]] std::string take() { return std::move(bytes_); }

  private:
    void raw(const void* data, std::size_t size) { bytes_.append(static_cast<const char*>(data), size); }

    std::string bytes_;
};

/// Every count is compared with what is left before anything is allocated for it.
class Reader {
  public:
    explicit Reader(std::string_view bytes) : left_(bytes) {}

    std::uint64_t number() {
        std::uint64_t value = 0;
        if (const std::string_view bytes = take(1, sizeof value); !bytes.empty())
            std::memcpy(&value, bytes.data(), sizeof value);
        return value;
    }
    void names(std::vector<std::string>& names) {
        for (std::uint64_t count = number(); count > 0 && good_; --count)
            names.emplace_back(take(number(), 1));
    }
    template <class Element>
    void array(std::vector<Element>& elements) {
        const std::string_view bytes = take(number(), sizeof(Element));
        elements.resize(bytes.size() / sizeof(Element));
        if (!bytes.empty()) std::memcpy(elements.data(), bytes.data(), bytes.size());
    }
    [[nodiscard]] bool all_read() const { return good_ && left_.empty(); }

  private:
    std::string_view take(std::uint64_t count, std::size_t size_of_one) {
        good_ = good_ && count <= left_.size() / size_of_one;
        if (!good_) return {};
        const std::string_view taken = left_.substr(0, std::size_t(count) * size_of_one);
        left_.remove_prefix(taken.size());
        return taken;
    }

    std::string_view left_;
    bool good_ = true;
};

template <class Element>
std::size_t size_of(const std::vector<Element>& elements) {
    return elements.size() * sizeof(Element);
}

}  // namespace

std::string model_bytes(const ObjModel& model) {
    constexpr std::size_t k_some_names = 4096;
    const Mesh& mesh = model.mesh;
    Writer writer(size_of(mesh.positions) + size_of(mesh.normals) + size_of(mesh.uvs) +
                  size_of(mesh.triangles) + size_of(mesh.materials) + k_some_names);
    writer.number(model.degenerate_triangles);
    writer.names(model.material_names);
    writer.names(model.material_files);
    writer.array(mesh.positions);
    writer.array(mesh.normals);
    writer.array(mesh.uvs);
    writer.array(mesh.triangles);
    writer.array(mesh.materials);
    return writer.take();
}

std::optional<ObjModel> model_from_bytes(std::string_view bytes) {
    Reader reader(bytes);
    ObjModel model;
    Mesh& mesh = model.mesh;
    model.degenerate_triangles = std::size_t(reader.number());
    reader.names(model.material_names);
    reader.names(model.material_files);
    reader.array(mesh.positions);
    reader.array(mesh.normals);
    reader.array(mesh.uvs);
    reader.array(mesh.triangles);
    reader.array(mesh.materials);

    const bool materials_exist =
        mesh.materials.size() == mesh.triangles.size() &&
        std::all_of(mesh.materials.begin(), mesh.materials.end(),
                    [&](std::uint32_t id) { return id < model.material_names.size(); });
    if (!reader.all_read() || !materials_exist || !validate(mesh)) return std::nullopt;
    return model;
}

}  // namespace pathscope
