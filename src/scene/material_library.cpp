#include "material_library.hpp"

#include <fmt/format.h>

#include <utility>

#include "pathscope/core/log.hpp"
#include "text_scan.hpp"

namespace pathscope {
namespace {

void add(const MtlFile& mtl, MaterialLibrary::ByName& by_name) {
    for (const MaterialSource& source : mtl.materials) by_name.emplace(source.material.name, &source);
}

}  // namespace

Result<void> MaterialLibrary::open(const std::string& obj, const std::string& line, ByName& by_name) {
    Result<bool> whole = open_file(scene_name(obj, line), by_name);
    if (!whole) return whole.error();
    bool any = *whole;
    std::string_view rest = any ? std::string_view{} : line;
    for (std::string_view word = take_word(rest); !word.empty() && word != line; word = take_word(rest)) {
        Result<bool> part = open_file(scene_name(obj, word), by_name);
        if (!part) return part.error();
        any = any || *part;
    }
    if (!any)
        log_warning(fmt::format("{}: there is no such file, so its materials are missing.",
                                files_.display_name(scene_name(obj, line))));
    return {};
}

MaterialLibrary::ByName MaterialLibrary::all() const {
    ByName by_name;
    for (const auto& [name, mtl] : read_)
        if (mtl) add(*mtl, by_name);
    return by_name;
}

Result<bool> MaterialLibrary::open_file(const std::string& name, ByName& by_name) {
    auto known = read_.find(name);
    if (known == read_.end()) {
        Result<std::optional<MtlFile>> mtl = read(name);
        if (!mtl) return mtl.error();
        known = read_.emplace(name, std::move(*mtl)).first;
    }
    if (known->second) add(*known->second, by_name);
    return known->second.has_value();
}

Result<std::optional<MtlFile>> MaterialLibrary::read(const std::string& name) {
    Result<std::optional<std::string>> text = files_.find(name);
    if (!text) return text.error();
    if (!*text) return std::optional<MtlFile>{};
    Result<MtlFile> mtl = parse_mtl(**text, files_.display_name(name));
    if (!mtl) return mtl.error();

    for (const std::string& oddity : mtl->oddities) log_warning(oddity);
    if (!mtl->unused.empty())
        log_note(fmt::format("{}: these statements are not used: {}.", files_.display_name(name),
                             fmt::join(mtl->unused, ", ")));
    for (MaterialSource& source : mtl->materials)
        for (MapName* map :
             {&source.map_kd, &source.map_ks, &source.map_ke, &source.map_d, &source.map_roughness})
            if (!map->name.empty()) map->name = scene_name(name, map->name);
    return std::optional(std::move(*mtl));
}

}  // namespace pathscope
