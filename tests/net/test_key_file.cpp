#include "pathscope/net/key_file.hpp"

#include <sys/stat.h>

#include "pathscope/core/files.hpp"
#include "pathscope/core/log.hpp"
#include "pathscope/net/allow_list.hpp"

#include "testing.hpp"

using namespace pathscope;

namespace {

mode_t mode_of(const std::filesystem::path& path) {
    struct stat status {};
    REQUIRE(::stat(path.c_str(), &status) == 0);
    return status.st_mode & 07777;
}

void write(const std::filesystem::path& path, const std::string& text) {
    REQUIRE(bool(write_file_atomically(path, text)));
}

bool says(const Error& error, const std::string& part) {
    return error.message.find(part) != std::string::npos;
}

}  // namespace

TEST_CASE("key files: the secret one is private, the public one can be handed out, both are read again") {
    const testing::TemporaryFolder folder;
    const std::filesystem::path secret = folder.path() / "server.key";
    const mode_t before = ::umask(0);  // The widest: the mode must not come from it.
    const KeyPair keys = make_key_pair();
    REQUIRE(bool(write_key_files(secret, keys)));
    ::umask(before);
    CHECK(mode_of(secret) == 0600);
    CHECK(mode_of(folder.path() / "server.key.pub") == 0644);
    const auto read = read_secret_key_file(secret);
    REQUIRE(bool(read));
    CHECK(read->secret_key == keys.secret_key);
    CHECK(read->public_key == keys.public_key);
    CHECK(*public_key_of((folder.path() / "server.key.pub").string()) == keys.public_key);
    CHECK(*public_key_of(keys.public_key) == keys.public_key);
    CHECK(read_file(folder.path() / "server.key.pub")->find(keys.secret_key) == std::string::npos);
    // Nothing but the two files is left.
    CHECK(std::distance(std::filesystem::directory_iterator(folder.path()), {}) == 2);
}

TEST_CASE("a key is never overwritten, neither by its secret nor by its public file") {
    const testing::TemporaryFolder folder;
    const std::filesystem::path secret = folder.path() / "k", other = folder.path() / "other";
    const KeyPair keys = make_key_pair();
    REQUIRE(bool(write_key_files(secret, keys)));
    const auto again = write_key_files(secret, make_key_pair());
    REQUIRE_FALSE(bool(again));
    CHECK(says(again.error(), "exists"));
    std::filesystem::remove(folder.path() / "k.pub");
    CHECK_FALSE(bool(write_key_files(secret, make_key_pair())));
    CHECK(read_secret_key_file(secret)->secret_key == keys.secret_key);
    CHECK_FALSE(std::filesystem::exists(folder.path() / "k.pub"));

    write(folder.path() / "other.pub", "something\n");
    CHECK_FALSE(bool(write_key_files(other, make_key_pair())));
    CHECK_FALSE(std::filesystem::exists(other));
    CHECK_FALSE(bool(write_key_files(folder.path() / "no" / "folder", make_key_pair())));
}

TEST_CASE("a secret file that others can read or write is refused, and told how to close it") {
    const testing::TemporaryFolder folder;
    const std::filesystem::path secret = folder.path() / "k";
    REQUIRE(bool(write_key_files(secret, make_key_pair())));
    for (const mode_t mode : {0644, 0640, 0604, 0620, 0601}) {
        REQUIRE(::chmod(secret.c_str(), mode) == 0);
        const auto read = read_secret_key_file(secret);
        REQUIRE_FALSE(bool(read));
        CHECK(says(read.error(), "chmod 600"));
        CHECK(says(read.error(), secret.string()));
    }
    for (const mode_t mode : {0600, 0400}) {
        REQUIRE(::chmod(secret.c_str(), mode) == 0);
        CHECK(bool(read_secret_key_file(secret)));
    }
}

TEST_CASE("files that are no key files are sentences that name them and tell no secret") {
    const testing::TemporaryFolder folder;
    const KeyPair keys = make_key_pair(), other = make_key_pair();
    const std::filesystem::path file = folder.path() / "k";
    for (const std::string& text :
         {std::string(), std::string("nonsense\n"), "public " + keys.public_key + "\n",
          std::string("secret short\n"), "public " + other.public_key + "\nsecret " + keys.secret_key + "\n",
          std::string(100'000, 'x')}) {
        write(file, text);
        REQUIRE(::chmod(file.c_str(), 0600) == 0);
        const auto read = read_secret_key_file(file);
        REQUIRE_FALSE(bool(read));
        CHECK(says(read.error(), file.string()));
        CHECK_FALSE(says(read.error(), keys.secret_key));
    }
    CHECK_FALSE(bool(read_secret_key_file(folder.path())));
    CHECK_FALSE(bool(read_secret_key_file(folder.path() / "none")));
    CHECK_FALSE(bool(public_key_of((folder.path() / "none").string())));
    write(file, keys.public_key + "\n" + other.public_key + "\n");
    CHECK_FALSE(bool(public_key_of(file.string())));  // Which of the two?
}

TEST_CASE("a list holds keys, comments and empty lines; anything else is a mistake with its line") {
    const KeyPair a = make_key_pair(), b = make_key_pair(), c = make_key_pair();
    const KeyList list =
        parse_key_list("# servers\n#\n\n" + a.public_key + " # render-01\r\n  " + b.public_key +
                           "\nnonsense\n" + c.public_key + " name without a sign\n#" + "\n",
                       "list");
    CHECK(list.keys == std::vector{a.public_key, b.public_key});
    REQUIRE(list.mistakes.size() == 2);
    CHECK(list.mistakes[0].find("list:6:") == 0);
    CHECK(list.mistakes[1].find("list:7:") == 0);
}

TEST_CASE("a list is read again: a change counts when two looks agree on it") {
    const testing::TemporaryFolder folder;
    const std::filesystem::path file = folder.path() / "list";
    const KeyPair a = make_key_pair(), b = make_key_pair();
    CHECK_FALSE(bool(AllowList::open(file)));
    write(file, "nonsense\n");
    CHECK_FALSE(bool(AllowList::open(file)));
    write(file, a.public_key + " # a\n" + b.public_key + " # b\n");
    auto list = AllowList::open(file);
    REQUIRE(bool(list));
    CHECK(list->keys().size() == 2);

    int warnings = 0;
    const ScopedLogSink counting([&](LogLevel, std::string_view) { ++warnings; });
    TimeNs now = 1'000 * k_second_ns;
    const auto looks = [&](int times) {  // How many of so many looks saw a change.
        int changes = 0;
        for (int i = 0; i < times; ++i) changes += list->changed(now += AllowList::k_look);
        return changes;
    };
    CHECK(looks(4) == 0);

    write(file, b.public_key + " # b\n");
    CHECK(looks(1) == 0);
    CHECK_FALSE(list->changed(now + AllowList::k_look - 1));  // Not yet time for a second look.
    CHECK(looks(1) == 1);
    CHECK(list->keys() == std::vector{b.public_key});

    write(file, "");  // An editor at work.
    CHECK(looks(1) == 0);
    write(file, "# only b\n" + b.public_key + "\n");
    CHECK(looks(4) == 0);  // The same keys.
    CHECK(warnings == 0);

    write(file, "oops\n" + a.public_key + "\n");  // A mistake keeps no other line from counting.
    CHECK(looks(4) == 1);
    CHECK(list->keys() == std::vector{a.public_key});
    CHECK(warnings == 1);

    std::filesystem::remove(file);
    CHECK(looks(4) == 1);
    CHECK(list->keys().empty());
    CHECK(warnings == 2);
    write(file, a.public_key + "\n");
    CHECK(looks(4) == 1);
    CHECK(list->keys() == std::vector{a.public_key});
}
