// qduino-supervisor on a system that behaves as its first argument says; the others are the
// supervisor's own.
//
//   reap-blocks     a dead child is never collected
//   poll-invalid    poll answers at once, for ever, that every descriptor is invalid
//   poll-broken     poll fails at once, for ever
//   signal-broken   poll says at once, for ever, that a signal has come; it cannot be read
//   kill-fails      no signal reaches the sketch in the first half second
//   spins           the first poll takes 300 ms of the processor, and only then begins
//
// At its end it writes into the file REPORT of its environment: how often it polled, in how many
// seconds, and the scheduling policy that it had after the first poll.
#include <sched.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <fstream>
#include <string>

#include "apps/supervisor/supervisor.h"
#include "board/linux/kernel/clock.h"

namespace {

using namespace qduino;
using board::linux::monotonic_now;

class Hooked final : public supervisor::SystemCalls {
  public:
    explicit Hooked(std::string hook) : hook_(std::move(hook)) {}
    ~Hooked() override {
        const char* report = std::getenv("REPORT");
        if (!report) return;
        std::ofstream{report} << polls_ << ' ' << to_seconds(monotonic_now() - started_) << ' '
                              << first_policy_ << '\n';
    }
    Hooked(const Hooked&) = delete;
    Hooked& operator=(const Hooked&) = delete;

    int poll(pollfd* events, nfds_t count, int timeout_ms) override {
        if (++polls_ == 1 && hook_ == "spins") spin();
        if (polls_ == 1) first_policy_ = ::sched_getscheduler(0) & ~SCHED_RESET_ON_FORK;
        if (hook_ == "poll-broken") {
            errno = EINTR;
            return -1;
        }
        const bool invalid = hook_ == "poll-invalid";
        if (!invalid && hook_ != "signal-broken") return SystemCalls::poll(events, count, timeout_ms);
        for (nfds_t i = 0; i < count; ++i)
            events[i].revents = static_cast<short>(invalid ? POLLNVAL : i == 1 ? POLLIN : 0);
        return static_cast<int>(count);
    }
    bool read_signal(int descriptor, signalfd_siginfo& signal) override {
        return hook_ != "signal-broken" && SystemCalls::read_signal(descriptor, signal);
    }
    bool kill(int pidfd, int signal) override {
        if (hook_ != "kill-fails" || signal == 0) return SystemCalls::kill(pidfd, signal);
        if (first_kill_ == kEpoch) first_kill_ = monotonic_now();
        return monotonic_now() - first_kill_ > 500ms && SystemCalls::kill(pidfd, signal);
    }
    void reap(pid_t child) override {
        while (hook_ == "reap-blocks") ::pause();
        SystemCalls::reap(child);
    }

  private:
    static void spin() {
        const Instant end = monotonic_now() + 300ms;
        while (monotonic_now() < end) {
        }
    }

    std::string hook_;
    long polls_ = 0;
    int first_policy_ = -1;
    Instant started_ = monotonic_now();
    Instant first_kill_ = kEpoch;
};

}  // namespace

int main(int argc, char** argv) {
    if (argc < 2) return 2;
    Hooked system{argv[1]};
    argv[1] = argv[0];
    return supervisor::run_command_line(argc - 1, argv + 1, system);
}
