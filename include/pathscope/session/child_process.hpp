#pragma once
/// A child process of ours: started, watched, and never left behind.
///
/// Why: `--servers N` runs render servers as children. They must end when the client does, however it ends: the kernel
/// sends them SIGTERM when the thread that started them is gone (PR_SET_PDEATHSIG), and the destructor asks them to
/// end and waits.
/// Requires: start() is called on a thread that lives as long as the child should.
/// Thread safety: one thread at a time.   Test: tests/session/test_child_process.cpp

#include <sys/types.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "pathscope/core/clock.hpp"
#include "pathscope/core/result.hpp"

namespace pathscope {

class ChildProcess {
  public:
    /// Starts `program` (a path) with `arguments`; standard output goes to ours, standard input is empty.
    [[nodiscard]] static Result<ChildProcess> start(const std::filesystem::path& program,
                                                    const std::vector<std::string>& arguments);

    ~ChildProcess();  ///< SIGTERM, then SIGKILL for one that has not ended after k_grace.
    ChildProcess(ChildProcess&& other) noexcept;
    ChildProcess& operator=(ChildProcess&& other) noexcept;

    [[nodiscard]] pid_t pid() const { return pid_; }

    /// "exit code 1" or "signal 9" once the process has ended, nothing while it runs.
    [[nodiscard]] std::optional<std::string> ending();

    void send_signal(int signal) const;  ///< Nothing happens when it has ended.

    /// Waits until the process has ended, `timeout` at most. Returns whether it has.
    bool wait(TimeNs timeout);

    static constexpr TimeNs k_grace = 2 * k_second_ns;

  private:
    ChildProcess(pid_t pid, int pid_descriptor) : pid_(pid), pid_descriptor_(pid_descriptor) {}
    void end();

    pid_t pid_ = -1;
    int pid_descriptor_ = -1;
    std::optional<std::string> ending_;
};

/// The folder of the running program, where its sister programs lie.
[[nodiscard]] std::filesystem::path program_folder();

}  // namespace pathscope
