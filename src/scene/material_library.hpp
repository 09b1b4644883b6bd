#pragma once
/// The MTL files of a scene, each read once, whatever number of OBJ files name it.
/// Thread safety: one thread.   Test: tests/scene/test_load.cpp

#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "pathscope/core/result.hpp"
#include "pathscope/scene/file_source.hpp"
#include "pathscope/scene/mtl.hpp"

namespace pathscope {

class MaterialLibrary {
  public:
    explicit MaterialLibrary(FileSource& files) : files_(files) {}

    using ByName = std::map<std::string_view, const MaterialSource*>;

    /// Adds the materials of a mtllib line of `obj` to `by_name`; names that are there already keep their
    /// material. The line names one file, whose name may hold blanks, or several. Maps come out relative to the
    /// scene. A missing file is mentioned, no error.
    [[nodiscard]] Result<void> open(const std::string& obj, const std::string& line, ByName& by_name);

    /// All that any open() has found.
    [[nodiscard]] ByName all() const;

  private:
    /// Whether there is such a file.
    Result<bool> open_file(const std::string& name, ByName& by_name);
    Result<std::optional<MtlFile>> read(const std::string& name);

    FileSource& files_;
    std::map<std::string, std::optional<MtlFile>> read_;
};

}  // namespace pathscope
