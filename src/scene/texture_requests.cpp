#include "texture_requests.hpp"

#include <fmt/format.h>

#include <atomic>
#include <optional>
#include <set>

#include "pathscope/core/log.hpp"
#include "pathscope/core/parallel_for.hpp"
#include "pathscope/scene/load.hpp"

namespace pathscope {

TextureUse TextureRequests::request(const MapName& map, TextureUsage usage) {
    if (map.name.empty()) return {};
    const auto [entry, is_new] = numbers_.try_emplace({map.name, usage}, std::int32_t(requests_.size()));
    if (is_new) requests_.push_back(entry->first);
    return {entry->second, map.scale, map.offset};
}

Result<std::vector<Texture>> TextureRequests::load(FileSource& files, TexelSpace space,
                                                   std::vector<Material>& materials) const {
    std::vector<std::optional<std::string>> bytes;
    for (const Request& request : requests_) {
        Result<std::optional<std::string>> found = files.find(request.first);
        if (!found) return found.error();
        bytes.push_back(std::move(*found));
    }
    std::vector<Result<Texture>> decoded(requests_.size(), bad_input(""));
    std::atomic<std::size_t> total_bytes{0};
    parallel_for(std::int64_t(requests_.size()), 0, [&](int number) {
        const auto i = std::size_t(number);
        const auto& [name, usage] = requests_[i];
        if (!bytes[i])
            decoded[i] = bad_input(fmt::format("{}: there is no such file.", files.display_name(name)));
        else if (total_bytes <= k_max_texture_bytes)
            decoded[i] = decode_texture(*bytes[i], usage, space, files.display_name(name));
        if (decoded[i]) total_bytes += decoded[i]->bytes();
    });
    if (total_bytes > k_max_texture_bytes)
        return bad_input(fmt::format("The scene's textures take more than {} MiB; make some smaller.",
                                     k_max_texture_bytes >> 20));
    return collect(decoded, materials);
}

std::vector<Texture> TextureRequests::collect(std::vector<Result<Texture>>& decoded,
                                              std::vector<Material>& materials) const {
    std::vector<Texture> textures;
    std::vector<std::int32_t> final_number(requests_.size(), -1);
    std::set<std::string> mentioned;
    for (std::size_t i = 0; i < requests_.size(); ++i) {
        if (decoded[i]) {
            final_number[i] = std::int32_t(textures.size());
            textures.push_back(std::move(*decoded[i]));
        } else if (mentioned.insert(requests_[i].first).second) {
            log_warning(
                fmt::format("{} What uses this texture is shown without it.", decoded[i].error().message));
        }
    }
    for (Material& m : materials)
        for (TextureUse* use : {&m.map_kd, &m.map_ks, &m.map_ke, &m.map_d, &m.map_roughness}) {
            if (*use) use->index = final_number[std::size_t(use->index)];
            if (!*use) *use = {};
        }
    return textures;
}

}  // namespace pathscope
