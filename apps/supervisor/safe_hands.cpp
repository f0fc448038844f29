#include "apps/supervisor/safe_hands.h"

#include <sched.h>

#include <algorithm>
#include <cerrno>

#include "apps/supervisor/dying_threads.h"
#include "board/linux/kernel/clock.h"
#include "board/linux/kernel/importance.h"
#include "link/link_file.h"

namespace qduino::supervisor {
namespace {

using board::SketchDeath;
using board::linux::block_until;
using board::linux::monotonic_now;

constexpr Nanoseconds kRealTimeWait = 100ms;
constexpr int kLookMs = 5;
constexpr Nanoseconds kKillAgain = 100ms;

/// The link at `path`. Nothing is mapped when it belongs to another living sketch: that link must
/// stay open. (The sketch may be a child of the started process, a script.)
apps::LinkFile link_of(const std::string& path, pid_t sketch) {
    Result<apps::LinkFile> link = apps::map_link(path);
    if (!link.ok()) return {};
    const auto owner = static_cast<pid_t>(link->get()->sketch_pid);
    if (owner != sketch && owner > 0 && ::kill(owner, 0) == 0) return {};
    return std::move(*link);
}

/// Marks the link at `path` as that of a dead (or hung) sketch.
void mark_link_dead(const std::string& path, pid_t sketch, bool hung) {
    const apps::LinkFile link = link_of(path, sketch);
    if (link) link.get()->sketch_dead.store(hung ? 2 : 1, std::memory_order_release);
}

/// Ordinary threads of the dying process would wait for their turn among all others, and the
/// process's lines and files with them. Only a real-time process gives a rank.
void hurry(pid_t process) {
    let_threads_die(process, (::sched_getscheduler(0) & ~SCHED_RESET_ON_FORK) == SCHED_FIFO);
}

}  // namespace

void write_death_note(const std::string& path, pid_t sketch, std::string_view note) {
    const apps::LinkFile file = link_of(path, sketch);
    if (!file) return;
    printer::link::LinkLayout& link = *file.get();
    if (link.death_note_ready.load() != 0) return;
    const std::size_t size = std::min(note.size(), link.death_note.size() - 1);
    std::copy_n(note.begin(), size, link.death_note.begin());
    link.death_note[size] = '\0';
    link.death_note_ready.store(1, std::memory_order_release);
}

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
    importance::Pace pace;
    while (!cut.gone && monotonic_now() - from < kRealTimeWait) {
        pace.next_turn();
        cut.gone = wait_until_gone(sketch, kLookMs);
        cut.outputs = outputs_.force();
    }
    if (!cut.gone && sketch.pidfd >= 0) lower_threads(sketch.pid);
    return cut;
}

void SafeHands::outlast(const Dying& sketch, Cut& cut) {
    while (!cut.gone) {
        system_->kill(sketch.pidfd, SIGKILL);
        hurry(sketch.pid);
        const Instant next = monotonic_now() + kKillAgain;
        cut.gone = wait_until_gone(sketch, static_cast<int>(kKillAgain / 1ms));
        cut.outputs = outputs_.force();
        if (!cut.gone) block_until(next);
    }
}

}  // namespace qduino::supervisor
