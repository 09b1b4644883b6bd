/// make-atrium: writes the model and textures of scenes/atrium, the same bytes in every run.
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>

#include "model.hpp"

namespace {

using namespace pathscope;

Result<void> make_atrium(const std::filesystem::path& folder) {
    std::error_code error;
    std::filesystem::create_directories(folder, error);
    if (error)
        return bad_input(fmt::format("{}: no such folder can be made: {}", folder.string(), error.message()));

    atrium::Model model;
    atrium::build_house(model);
    atrium::furnish(model);
    if (const auto done = atrium::write_model(model, folder); !done) return done;
    if (const auto done = atrium::write_textures(folder); !done) return done;
    fmt::print("make-atrium: {}: {} triangles, {} materials\n", (folder / "atrium.obj").string(),
               model.triangles(), model.parts.size());
    return {};
}

}  // namespace

int main(int argc, char** argv) {
    CLI::App app{"Writes the model and textures of scenes/atrium: a courtyard with two floors of arcades."};
    app.set_version_flag("--version", "make-atrium " PATHSCOPE_VERSION);
    std::string folder = "scenes/atrium/generated";
    app.add_option("--out", folder, "The folder to write to; made if missing")->capture_default_str();
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        return app.exit(error) == 0 ? 0 : 2;
    }
    const auto done = make_atrium(folder);
    if (done) return 0;
    fmt::print(stderr, "make-atrium: {}\n", done.error().message);
    return done.error().kind == pathscope::ErrorKind::bad_input ? 2 : 1;
}
