#include "apps/supervisor/safe_hands.h"

#include <sched.h>

#include <cerrno>

#include "apps/supervisor/importance.h"
#include "apps/supervisor/link_death.h"
#include "board/linux/clock.h"

namespace qduino::supervisor {
namespace {

using board::linux::block_until;
using board::linux::monotonic_now;
using board::linux::SketchDeath;

constexpr Nanoseconds kRealTimeWait = 100ms;
constexpr int kLookMs = 5;
constexpr Nanoseconds kKillAgain = 100ms;

/// An ordinary thread of the dying process would wait for its turn among all others, and the
/// process's lines and files with it. A process that is not real-time itself may not do this; then
/// it takes as long as it takes.
void hurry(pid_t process) {
    if ((::sched_getscheduler(0) & ~SCHED_RESET_ON_FORK) != SCHED_FIFO) return;
    sched_param parameters{};
    parameters.sched_priority = kSupervisorPriority - 2;
    ::sched_setscheduler(process, SCHED_FIFO | SCHED_RESET_ON_FORK, &parameters);
}

}  // namespace

Result<void> SafeHands::open(const board::linux::PinsFile& file, int writer, const std::string& link,
                             const std::string& sysfs_root, SystemCalls& system) {
    file_ = &file;
    link_ = link;
    system_ = &system;
    return outputs_.open(file, writer, sysfs_root);
}

bool SafeHands::wait_until_gone(const Dying& sketch, int timeout_ms) {
    pollfd process{sketch.pidfd, POLLIN, 0};
    if (system_->poll(&process, 1, timeout_ms) > 0 && (process.revents & POLLIN) != 0) return true;
    // A second question, in case poll does not tell. A parent learns of its child; of other
    // processes, that they no longer exist.
    siginfo_t info{};
    if (::waitid(P_PID, static_cast<id_t>(sketch.pid), &info, WEXITED | WNOHANG | WNOWAIT) == 0)
        return info.si_pid != 0;
    return !system_->kill(sketch.pidfd, 0) && errno == ESRCH;
}

SafeHands::Cut SafeHands::cut(const Dying& sketch, SketchDeath how) {
    const Instant from = monotonic_now();
    Cut cut;
    cut.outputs = outputs_.force();
    cut.took = monotonic_now() - from;
    file_->layout().sketch_dead.store(static_cast<std::uint32_t>(how));
    if (!link_.empty()) mark_link_dead(link_, sketch.pid, how == SketchDeath::hung);

    cut.gone = wait_until_gone(sketch, 0);
    if (!cut.gone && sketch.pidfd >= 0) hurry(sketch.pid);
    Pace pace;
    while (!cut.gone && monotonic_now() - from < kRealTimeWait) {
        pace.next_turn();
        cut.gone = wait_until_gone(sketch, kLookMs);
        cut.outputs = outputs_.force();
    }
    return cut;
}

void SafeHands::outlast(const Dying& sketch, Cut& cut) {
    while (!cut.gone) {
        system_->kill(sketch.pidfd, SIGKILL);
        const Instant next = monotonic_now() + kKillAgain;
        cut.gone = wait_until_gone(sketch, static_cast<int>(kKillAgain / 1ms));
        cut.outputs = outputs_.force();
        if (!cut.gone) block_until(next);
    }
}

}  // namespace qduino::supervisor
