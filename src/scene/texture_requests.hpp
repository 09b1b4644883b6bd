#pragma once
/// Gives each image that a material uses a number; reads and decodes them all at the end, on all cores.
/// Thread safety: one thread.   Test: tests/scene/test_load.cpp

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "pathscope/core/result.hpp"
#include "pathscope/scene/file_source.hpp"
#include "pathscope/scene/mtl.hpp"
#include "pathscope/scene/texture.hpp"

namespace pathscope {

class TextureRequests {
  public:
    /// The same image for the same usage has one number, at any scale.
    [[nodiscard]] TextureUse request(const MapName& map, TextureUsage usage);

    /// An image that is missing or cannot be read is mentioned once; the materials that use it lose the map.
    /// An error if they need more than k_max_texture_bytes.
    [[nodiscard]] Result<std::vector<Texture>> load(FileSource& files, TexelSpace space,
                                                    std::vector<Material>& materials) const;

  private:
    using Request = std::pair<std::string, TextureUsage>;

    std::vector<Texture> collect(std::vector<Result<Texture>>& decoded,
                                 std::vector<Material>& materials) const;

    std::vector<Request> requests_;
    std::map<Request, std::int32_t> numbers_;
};

}  // namespace pathscope
