#include "apps/supervisor/sketch_process.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>

#include "board/linux/kernel/importance.h"
#include "posix/system_error.h"

namespace qduino::supervisor {
namespace {

using posix::system_error;
using posix::UniqueFd;

/// In the child: becomes the sketch, or writes the reason for its failure to `report`.
[[noreturn]] void become(const std::vector<std::string>& command, pid_t supervisor, int report) {
    ::prctl(PR_SET_PDEATHSIG, SIGTERM);
    if (::getppid() != supervisor) ::_exit(1);  // it died before the request above took hold
    sigset_t none;
    sigemptyset(&none);
    ::sigprocmask(SIG_SETMASK, &none, nullptr);
    importance::restore_real_time_limit();
    std::vector<char*> arguments;
    for (const auto& word : command) arguments.push_back(const_cast<char*>(word.c_str()));
    arguments.push_back(nullptr);
    ::execvp(arguments[0], arguments.data());
    const int error = errno;
    static_cast<void>(!::write(report, &error, sizeof error));
    ::_exit(127);
}

}  // namespace

Result<SketchProcess> SketchProcess::start(const std::vector<std::string>& command) {
    int ends[2];
    if (::pipe2(ends, O_CLOEXEC) != 0) return system_error("make", "a pipe");
    UniqueFd from_child{ends[0]};
    UniqueFd to_parent{ends[1]};
    const pid_t supervisor = ::getpid();
    SketchProcess process;
    process.pid_ = ::fork();
    if (process.pid_ < 0) return system_error("start", command[0]);
    if (process.pid_ == 0) become(command, supervisor, to_parent.get());
    to_parent.reset();
    int error = 0;
    // No bytes: exec closed the pipe, and all is well.
    if (::read(from_child.get(), &error, sizeof error) == sizeof error) {
        ::waitpid(process.pid_, nullptr, 0);
        return system_error("run", command[0], error);
    }
    process.pidfd_ = UniqueFd{static_cast<int>(::syscall(SYS_pidfd_open, process.pid_, 0))};
    if (!process.pidfd_.valid()) {
        const Error failed = system_error("watch", command[0]);
        ::kill(process.pid_, SIGKILL);
        ::waitpid(process.pid_, nullptr, 0);
        return failed;
    }
    return process;
}

bool SketchProcess::ended(Ending& ending) const {
    siginfo_t info{};
    if (::waitid(P_PID, static_cast<id_t>(pid_), &info, WEXITED | WNOHANG | WNOWAIT) != 0 || info.si_pid == 0)
        return false;
    ending.by_signal = info.si_code != CLD_EXITED;
    ending.status = info.si_status;
    return true;
}

}  // namespace qduino::supervisor
