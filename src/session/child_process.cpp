#include "pathscope/session/child_process.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>
#include <utility>

namespace pathscope {
namespace {

/// Runs in the child between fork and exec: only async-signal-safe calls. Tells errno through `report` if it fails.
[[noreturn]] void become(const char* program, char* const* arguments, pid_t parent, int report) {
    ::prctl(PR_SET_PDEATHSIG, SIGTERM);
    if (::getppid() != parent) ::_exit(1);  // The parent ended before the line above.
    const int nothing = ::open("/dev/null", O_RDONLY);
    if (nothing >= 0) ::dup2(nothing, STDIN_FILENO);
    ::execv(program, arguments);
    const int error = errno;
    [[maybe_unused]] const auto written = ::write(report, &error, sizeof error);
    ::_exit(127);
}

}  // namespace

Result<ChildProcess> ChildProcess::start(const std::filesystem::path& program,
                                         const std::vector<std::string>& arguments) {
    const auto refuse = [&](int error) {
        return failed(
            fmt::format("Cannot start {}: {}.", program.string(), std::generic_category().message(error)));
    };
    std::vector<std::string> texts{program.string()};
    texts.insert(texts.end(), arguments.begin(), arguments.end());
    std::vector<char*> pointers;
    for (std::string& text : texts) pointers.push_back(text.data());
    pointers.push_back(nullptr);

    // The pipe closes by itself when exec succeeds; when it fails, errno comes through it.
    int report[2];
    if (::pipe2(report, O_CLOEXEC) != 0) return refuse(errno);
    const pid_t parent = ::getpid();
    const pid_t pid = ::fork();
    if (pid == 0) become(texts[0].c_str(), pointers.data(), parent, report[1]);
    const int fork_error = errno;
    ::close(report[1]);
    int exec_error = 0;
    const bool exec_failed =
        pid > 0 && ::read(report[0], &exec_error, sizeof exec_error) == sizeof exec_error;
    ::close(report[0]);
    if (pid < 0) return refuse(fork_error);
    if (exec_failed) {
        ::waitpid(pid, nullptr, 0);
        return refuse(exec_error);
    }
    return ChildProcess(pid, int(::syscall(SYS_pidfd_open, pid, 0)));
}

ChildProcess::ChildProcess(ChildProcess&& other) noexcept
    : pid_(std::exchange(other.pid_, -1)),
      pid_descriptor_(std::exchange(other.pid_descriptor_, -1)),
      ending_(std::move(other.ending_)) {}

ChildProcess& ChildProcess::operator=(ChildProcess&& other) noexcept {
    if (this != &other) {
        end();
        pid_ = std::exchange(other.pid_, -1);
        pid_descriptor_ = std::exchange(other.pid_descriptor_, -1);
        ending_ = std::move(other.ending_);
    }
    return *this;
}

ChildProcess::~ChildProcess() { end(); }

void ChildProcess::end() {
    if (pid_ > 0 && !ending()) {
        send_signal(SIGCONT);  // A stopped process takes no SIGTERM.
        send_signal(SIGTERM);
        if (!wait(k_grace)) {
            send_signal(SIGKILL);
            wait(k_grace);
        }
    }
    if (pid_descriptor_ >= 0) ::close(pid_descriptor_);
    pid_ = pid_descriptor_ = -1;
}

std::optional<std::string> ChildProcess::ending() {
    if (ending_ || pid_ <= 0) return ending_;
    int status = 0;
    if (::waitpid(pid_, &status, WNOHANG) == pid_)
        ending_ = WIFSIGNALED(status) ? fmt::format("signal {}", WTERMSIG(status))
                                      : fmt::format("exit code {}", WEXITSTATUS(status));
    return ending_;
}

void ChildProcess::send_signal(int signal) const {
    if (pid_ > 0 && !ending_) ::kill(pid_, signal);
}

bool ChildProcess::wait(TimeNs timeout) {
    const TimeNs deadline = monotonic_now() + timeout;
    while (!ending()) {
        const TimeNs left = deadline - monotonic_now();
        if (left <= 0) return false;
        pollfd ended{pid_descriptor_, POLLIN, 0};
        ::poll(&ended, 1, static_cast<int>(left / k_millisecond_ns) + 1);
    }
    return true;
}

std::filesystem::path program_folder() {
    std::error_code ignored;
    return std::filesystem::read_symlink("/proc/self/exe", ignored).parent_path();
}

}  // namespace pathscope
