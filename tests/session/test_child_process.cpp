#include "pathscope/session/child_process.hpp"

#include <signal.h>

#include <cerrno>

#include "testing.hpp"

using namespace pathscope;

TEST_CASE("a child's exit code and its killing signal are told") {
    Result<ChildProcess> done = ChildProcess::start("/bin/sh", {"-c", "exit 3"});
    REQUIRE(bool(done));
    REQUIRE(done->wait(10 * k_second_ns));
    CHECK(done->ending() == "exit code 3");

    Result<ChildProcess> killed = ChildProcess::start("/bin/sleep", {"1000"});
    REQUIRE(bool(killed));
    CHECK_FALSE(killed->ending().has_value());
    CHECK_FALSE(killed->wait(k_millisecond_ns));
    killed->send_signal(SIGKILL);
    REQUIRE(killed->wait(10 * k_second_ns));
    CHECK(killed->ending() == "signal 9");
}

TEST_CASE("no child is left behind, not even a stopped one") {
    pid_t pid = 0;
    {
        Result<ChildProcess> child = ChildProcess::start("/bin/sleep", {"1000"});
        REQUIRE(bool(child));
        pid = child->pid();
        child->send_signal(SIGSTOP);
    }
    CHECK(::kill(pid, 0) == -1);
    CHECK(errno == ESRCH);
}

TEST_CASE("a program that is not there is a sentence") {
    const Result<ChildProcess> child = ChildProcess::start("/no/such/program", {});
    REQUIRE_FALSE(bool(child));
    CHECK(child.error().message == "Cannot start /no/such/program: No such file or directory.");
}
