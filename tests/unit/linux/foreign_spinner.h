// A real-time task of another process that spins on one core: what takes a core from a loop. It
// ends by itself, whatever becomes of the test, in four ways: after `length`; by RLIMIT_RTTIME soon
// after; with its parent; and by a guard, a process on core 0. Never on core 0, which the machine
// lives on.
#pragma once

#include <poll.h>
#include <sched.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <string>

#include "board/linux/kernel/clock.h"
#include "board/linux/kernel/real_time_thread.h"
#include "posix/small_file.h"
#include "posix/unique_fd.h"

namespace qduino::board::linux::test {

class ForeignSpinner {
  public:
    /// It enters the cpuset of `tasks_file` first; empty: it stays where it is.
    ForeignSpinner(int core, int priority, Nanoseconds length, const std::string& tasks_file = "") {
        if (core <= 0 || ::pipe(ends_.data()) != 0) return;
        const pid_t parent = ::getpid();
        pid_ = ::fork();
        if (pid_ == 0) spin(parent, core, priority, length, tasks_file);
        ::close(ends_[1]);
        told_ = posix::UniqueFd{ends_[0]};
        guard_ = ::fork();
        if (guard_ == 0) guard(length + 1s);
        if (::read(told_.get(), errors_.data(), sizeof errors_) != sizeof errors_) errors_ = {EIO, EIO};
    }
    ~ForeignSpinner() {
        for (const pid_t child : {pid_, guard_}) {
            if (child <= 0) continue;
            ::kill(child, SIGKILL);
            ::waitpid(child, nullptr, 0);
        }
    }
    ForeignSpinner(const ForeignSpinner&) = delete;
    ForeignSpinner& operator=(const ForeignSpinner&) = delete;

    [[nodiscard]] pid_t pid() const { return pid_; }
    /// errno of going to the core, and of getting the priority; 0: it has it. It spins if it has
    /// both.
    [[nodiscard]] int core_error() const { return errors_[0]; }
    [[nodiscard]] int priority_error() const { return errors_[1]; }
    [[nodiscard]] bool spins() const { return errors_[0] == 0 && errors_[1] == 0; }
    /// It has not ended.
    [[nodiscard]] bool lives() const {
        siginfo_t info{};
        return pid_ > 0 &&
               ::waitid(P_PID, static_cast<id_t>(pid_), &info, WEXITED | WNOHANG | WNOWAIT) == 0 &&
               info.si_pid == 0;
    }

  private:
    [[noreturn]] void spin(pid_t parent, int core, int priority, Nanoseconds length,
                           const std::string& tasks_file) const {
        ::prctl(PR_SET_PDEATHSIG, SIGKILL);
        if (::getppid() != parent) ::_exit(1);
        name_thread("core-thief");
        const rlimit real_time{static_cast<rlim_t>(length / 1us) + 200'000,
                               static_cast<rlim_t>(length / 1us) + 200'000};
        ::setrlimit(RLIMIT_RTTIME, &real_time);
        if (!tasks_file.empty()) static_cast<void>(!posix::write_small_file(tasks_file, "0"));
        cpu_set_t only;
        CPU_ZERO(&only);
        CPU_SET(static_cast<std::size_t>(core), &only);
        std::array<int, 2> errors{::sched_setaffinity(0, sizeof only, &only) == 0 ? 0 : errno, 0};
        sched_param parameters{};
        parameters.sched_priority = priority;
        if (errors[0] == 0) errors[1] = ::sched_setscheduler(0, SCHED_FIFO, &parameters) == 0 ? 0 : errno;
        static_cast<void>(!::write(ends_[1], errors.data(), sizeof errors));
        const Instant end = monotonic_now() + length;
        while (errors[0] == 0 && errors[1] == 0 && monotonic_now() < end) {
        }
        ::_exit(0);
    }

    /// Waits on core 0 for the spinner's end, also when the test has died, and brings it about
    /// after `limit`.
    [[noreturn]] void guard(Nanoseconds limit) const {
        static_cast<void>(!pin_to_core(0));
        const int spinner = static_cast<int>(::syscall(SYS_pidfd_open, pid_, 0));
        pollfd ended{spinner, POLLIN, 0};
        if (spinner >= 0 && ::poll(&ended, 1, static_cast<int>(limit / 1ms)) == 0)
            ::syscall(SYS_pidfd_send_signal, spinner, SIGKILL, nullptr, 0);
        ::_exit(0);
    }

    std::array<int, 2> ends_{-1, -1};
    std::array<int, 2> errors_{EIO, EIO};
    posix::UniqueFd told_;
    pid_t pid_ = -1;
    pid_t guard_ = -1;
};

}  // namespace qduino::board::linux::test
