#pragma once
/// What the command lines of all programs share: levers by name, sizes, ports, and errors as one sentence.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "pathscope/core/enum_names.hpp"
#include "pathscope/core/result.hpp"
#include "pathscope/image/block.hpp"
#include "pathscope/net/key_file.hpp"
#include "pathscope/scene/mesh_cache.hpp"
#include "pathscope/session/build_identity.hpp"

namespace pathscope {

/// --NAME a|b|c, checked against the enum's table.
template <class E>
CLI::Option* add_lever(CLI::App& app, const std::string& flag, E& value, const std::string& help) {
    std::vector<std::string> names;
    for (const auto& entry : enum_table(E{})) names.emplace_back(entry.name);
    const auto assign = [&value](const std::string& word) { value = *from_name<E>(word); };
    return app
        .add_option_function<std::string>(flag, assign, help + " (" + std::string(name_of(value)) + ")")
        ->check(CLI::IsMember(names))
        ->type_name(joined_names<E>());
}

/// "640x360" -> {640, 360}
inline CLI::Option* add_size(CLI::App& app, std::optional<std::pair<int, int>>& size,
                             const std::string& help) {
    const auto assign = [&size](const std::string& text) {
        const std::vector<std::string> sides = CLI::detail::split(text, 'x');
        std::pair<int, int> read;
        const auto is_side = [](const std::string& side, int& value) {
            return CLI::detail::lexical_cast(side, value) && value >= 1 && value <= k_max_image_side;
        };
        if (sides.size() != 2 || !is_side(sides[0], read.first) || !is_side(sides[1], read.second))
            throw CLI::ValidationError(
                "--size", fmt::format("'{}' is not a size from 1x1 to {}x{}, as in 640x360", text,
                                      k_max_image_side, k_max_image_side));
        size = read;
    };
    return app.add_option_function<std::string>("--size", assign, help)->type_name("WxH");
}

/// "5555,5556,5557" -> three ports from 1 to 65535.
inline CLI::Option* add_ports(CLI::App& app, std::array<int, 3>& ports, const std::string& flag = "--ports",
                              const std::string& help = "") {
    const auto assign = [&ports, flag](const std::string& text) {
        const std::vector<std::string> parts = CLI::detail::split(text, ',');
        bool good = parts.size() == ports.size();
        for (std::size_t i = 0; good && i < ports.size(); ++i)
            good = CLI::detail::lexical_cast(parts[i], ports[i]) && ports[i] >= 1 && ports[i] <= 65535;
        if (!good)
            throw CLI::ValidationError(
                flag, "'" + text + "' is not three ports from 1 to 65535, as in 5555,5556,5557");
    };
    return app
        .add_option_function<std::string>(
            flag, assign,
            help + fmt::format("input, monitor and frames ({},{},{})", ports[0], ports[1], ports[2]))
        ->type_name("A,B,C");
}

/// --name NAME
inline CLI::Option* add_name(CLI::App& app, std::string& name) {
    return app.add_option("--name", name, "for people (host name and process id)")
        ->check(CLI::Validator(
            [](const std::string& text) {
                return text.empty() || text.size() > 64 ? std::string("a name has 1 to 64 bytes")
                                                        : std::string();
            },
            "NAME"))
        ->type_name("NAME");
}

/// --mesh-cache DIR|off, as a word that mesh_cache_of() understands; empty if it is not given.
inline CLI::Option* add_mesh_cache(CLI::App& app, std::string& word) {
    return app
        .add_option("--mesh-cache", word,
                    "folder for parsed OBJ files, by content; safe to delete (in the user's cache folder)")
        ->check(CLI::Validator(
            [](const std::string& name) { return name.empty() ? std::string("a folder has a name") : ""; },
            "DIR"))
        ->type_name("DIR|off");
}

/// In the folder that was named, or in `meshes` in the user's or the server's cache folder.
inline std::optional<MeshCache> mesh_cache_of(const std::string& word,
                                              const std::filesystem::path& cache_folder) {
    if (word == "off") return std::nullopt;
    return MeshCache(word.empty() ? cache_folder / "meshes" : std::filesystem::path(word));
}

/// --keygen FILE: ends the parsing wherever it stands, as --help does.
struct KeygenRequest : CLI::Success {
    explicit KeygenRequest(std::string name)
        : CLI::Success("keygen", CLI::ExitCodes::Success), path(std::move(name)) {}
    std::filesystem::path path;
};
inline CLI::Option* add_keygen(CLI::App& app) {
    return app
        .add_option_function<std::string>(
            "--keygen", [](const std::string& path) { throw KeygenRequest(path); },
            "write a new secret key to FILE and its public one to FILE.pub, print that, and leave")
        ->trigger_on_parse()
        ->type_name("FILE");
}

/// Parses; gives the text to print for --help, --version and --keygen, nothing when the program shall go on.
inline Result<std::optional<std::string>> parse_arguments(CLI::App& app, int argc, const char* const* argv) {
    app.set_version_flag("--version", app.get_name() + " " + program_version());
    app.get_formatter()->column_width(34);
    try {
        app.parse(argc, argv);
        return std::optional<std::string>();
    } catch (const CLI::CallForHelp&) {
        return std::optional(app.help());
    } catch (const KeygenRequest& request) {
        const KeyPair keys = make_key_pair();
        const auto written = write_key_files(request.path, keys);
        if (!written) return written.error();
        return std::optional(keys.public_key + "\n");
    } catch (const CLI::CallForVersion&) {
        return std::optional(app.version() + "\n");
    } catch (const CLI::ParseError& error) {
        std::string sentence = error.what();
        while (!sentence.empty() && (sentence.back() == '.' || sentence.back() == '\n')) sentence.pop_back();
        return bad_input(sentence + ". See " + app.get_name() + " --help.");
    }
}

/// For main(): prints the error; the exit code that it leads to.
inline int report(const std::string& program, const Error& error) {
    std::fprintf(stderr, "%s: %s\n", program.c_str(), error.message.c_str());
    return error.kind == ErrorKind::bad_input ? 2 : 1;
}

}  // namespace pathscope
