#pragma once
/// Files that a test writes down as strings.

#include <map>
#include <string>

#include "pathscope/scene/file_source.hpp"

namespace pathscope::testing {

class MemoryFiles final : public FileSource {
  public:
    MemoryFiles() = default;
    MemoryFiles(std::initializer_list<std::pair<const std::string, std::string>> list) : files(list) {}

    Result<std::optional<std::string>> find(std::string_view name) override {
        const auto file = files.find(name);
        if (file == files.end()) return std::optional<std::string>{};
        return std::optional(file->second);
    }

    std::map<std::string, std::string, std::less<>> files;
};

}  // namespace pathscope::testing
