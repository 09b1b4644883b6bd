/// fuzz_seeds FOLDER: writes what each target begins with into FOLDER/TARGET/.

#include <fmt/format.h>

#include <cstdio>
#include <filesystem>

#include "fuzz_target.hpp"
#include "pathscope/core/files.hpp"
#include "pathscope/core/hash.hpp"

int main(int argc, char** argv) {
    using namespace pathscope;
    if (argc != 2) {
        std::fputs("usage: fuzz_seeds FOLDER\n", stderr);
        return 2;
    }
    for (const fuzz::FuzzTarget* target : fuzz::all_targets()) {
        const std::filesystem::path folder = std::filesystem::path(argv[1]) / target->name;
        std::filesystem::create_directories(folder);
        for (const std::string& seed : target->seeds()) {
            const Result<void> written =
                write_file_atomically(folder / to_hex(hash_text(seed)).substr(0, 16), seed);
            if (!written) return std::fprintf(stderr, "%s\n", written.error().message.c_str()), 1;
        }
    }
}
