// A real-time task of another process that spins on one core: what takes a core from a loop. It
// ends by itself, whatever becomes of the test: after `length`, by RLIMIT_RTTIME soon after, and
// with its parent. Never on core 0, which the machine lives on.
#pragma once

#include <sched.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>

#include "board/linux/clock.h"
#include "board/linux/real_time_thread.h"
#include "posix/unique_fd.h"

namespace qduino::board::linux::test {

class ForeignSpinner {
  public:
    ForeignSpinner(int core, int priority, Nanoseconds length) {
        if (core <= 0 || ::pipe(ends_.data()) != 0) return;
        pid_ = ::fork();
        if (pid_ == 0) spin(core, priority, length);
        ::close(ends_[1]);
        told_ = posix::UniqueFd{ends_[0]};
        if (::read(told_.get(), errors_.data(), sizeof errors_) != sizeof errors_) errors_ = {EIO, EIO};
    }
    ~ForeignSpinner() {
        if (pid_ <= 0) return;
        ::kill(pid_, SIGKILL);
        ::waitpid(pid_, nullptr, 0);
    }
    ForeignSpinner(const ForeignSpinner&) = delete;
    ForeignSpinner& operator=(const ForeignSpinner&) = delete;

    [[nodiscard]] pid_t pid() const { return pid_; }
    /// errno of going to the core, and of getting the priority; 0: it has it. It spins if it has
    /// both.
    [[nodiscard]] int core_error() const { return errors_[0]; }
    [[nodiscard]] int priority_error() const { return errors_[1]; }
    [[nodiscard]] bool spins() const { return errors_[0] == 0 && errors_[1] == 0; }

  private:
    [[noreturn]] void spin(int core, int priority, Nanoseconds length) const {
        ::prctl(PR_SET_PDEATHSIG, SIGKILL);
        name_thread("core-thief");
        const rlimit real_time{static_cast<rlim_t>(length / 1us) + 200'000,
                               static_cast<rlim_t>(length / 1us) + 200'000};
        ::setrlimit(RLIMIT_RTTIME, &real_time);
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

    std::array<int, 2> ends_{-1, -1};
    std::array<int, 2> errors_{EIO, EIO};
    posix::UniqueFd told_;
    pid_t pid_ = -1;
};

}  // namespace qduino::board::linux::test
