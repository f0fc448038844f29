#include "apps/supervisor/supervisor.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/signalfd.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstring>

#include "board/linux/clock.h"
#include "board/linux/gpio_pin.h"
#include "board/linux/virtual_pins.h"
#include "printer/link/layout.h"

namespace qduino::supervisor {
namespace {

using board::linux::monotonic_now;
using board::linux::PinsFile;
using board::linux::PinsLayout;
using board::linux::PinsRole;

constexpr int kPollMs = 10;
/// A sketch that was asked to stop has so long, then it is killed.
constexpr Nanoseconds kStopGrace = 5s;
/// A killed process that still does not go (it is stuck in the kernel) is not waited for longer.
constexpr int kKillWaitMs = 50;
constexpr Nanoseconds kFirstBackoff = 200ms;
constexpr Nanoseconds kLastBackoff = 5s;

}  // namespace

Result<Supervisor> Supervisor::open(Options options) {
    Supervisor supervisor;
    if (options.make_pins) {
        auto made = PinsFile::create(options.pins);
        if (!made) return made.error();
        supervisor.machine_role_ = std::move(*made);
    }
    auto file = PinsFile::open(options.pins, PinsRole::supervisor);
    if (!file) return file.error();
    supervisor.file_ = std::move(*file);
    auto opened = supervisor.writer_.open(supervisor.file_, board::linux::kSupervisorWriter, board::kNoVcpu);
    if (!opened) return opened.error();
    supervisor.options_ = std::move(options);
    return supervisor;
}

int Supervisor::run(int signals) {
    Nanoseconds backoff = kFirstBackoff;
    for (;;) {
        file_.layout().heartbeat_bound_ns.store(to_ns(options_.heartbeat_timeout));
        for (auto& beat : file_.layout().heartbeats)
            beat.expected_by_ns.store(0);  // promises of an earlier sketch
        lines_.clear();                    // the new sketch needs them
        auto sketch = SketchProcess::start(options_.command);
        if (!sketch) {
            std::fprintf(stderr, "qduino-supervisor: %s\n",
                         std::string{sketch.error().message.view()}.c_str());
            return 127;
        }
        const Instant started = monotonic_now();
        const Watched watched = watch(*sketch, signals);
        make_safe(watched, sketch->pid());
        const bool well = watched.outcome == Outcome::ended && watched.ending.exit_status() == 0;
        if (well || stop_asked_ || !options_.restart) return watched.ending.exit_status();

        if (monotonic_now() - started > kLastBackoff) backoff = kFirstBackoff;
        pollfd stop{signals, POLLIN, 0};
        if (::poll(&stop, 1, static_cast<int>(backoff / 1ms)) > 0) return watched.ending.exit_status();
        backoff = std::min(2 * backoff, kLastBackoff);
    }
}

board::VcpuId Supervisor::overdue_loop(Instant now) const {
    for (board::VcpuId vcpu = 1; vcpu < board::kVcpuLimit; ++vcpu) {
        const std::int64_t by_ns =
            file_.layout().heartbeats[vcpu].expected_by_ns.load(std::memory_order_relaxed);
        if (by_ns != 0 && to_ns(now) > by_ns) return vcpu;
    }
    return board::kNoVcpu;
}

Supervisor::Watched Supervisor::watch(const SketchProcess& sketch, int signals) {
    Watched watched;
    Instant kill_at = kForever;
    for (;;) {
        std::array<pollfd, 2> events{{{sketch.descriptor(), POLLIN, 0}, {signals, POLLIN, 0}}};
        ::poll(events.data(), events.size(), kPollMs);
        if (sketch.wait(0, watched.ending)) return watched;
        if ((events[1].revents & POLLIN) != 0) {
            signalfd_siginfo signal{};
            if (::read(signals, &signal, sizeof signal) == sizeof signal) {
                // Ctrl-C in a terminal reaches the sketch by itself: twice would mean "at once".
                if (signal.ssi_code != SI_KERNEL) sketch.send(static_cast<int>(signal.ssi_signo));
                stop_asked_ = true;
                kill_at = std::min(kill_at, monotonic_now() + kStopGrace);
            }
        }
        const Instant now = monotonic_now();
        if (options_.heartbeat_timeout > Nanoseconds{0}) watched.hung_loop = overdue_loop(now);
        if (watched.hung_loop == board::kNoVcpu && now < kill_at) continue;
        if (watched.hung_loop != board::kNoVcpu) {
            const auto& beat = file_.layout().heartbeats[watched.hung_loop];
            watched.overdue = now - instant_from_ns(beat.expected_by_ns.load(std::memory_order_relaxed));
        }
        watched.outcome = Outcome::hung;
        watched.ending = {true, SIGKILL};
        sketch.send(SIGKILL);
        static_cast<void>(sketch.wait(kKillWaitMs, watched.ending));
        return watched;
    }
}

void Supervisor::make_safe(const Watched& watched, pid_t sketch) {
    const Instant from = monotonic_now();
    PinsLayout& layout = file_.layout();
    // Writers that died in the middle of a write would hold the machine back for a moment.
    for (int writer = 0; writer < board::linux::kWriterCount; ++writer) {
        if (writer != board::linux::kSupervisorWriter)
            layout.writers[static_cast<std::size_t>(writer)].writing.store(0);
    }
    const int pins = board::linux::force_safe_states(layout, writer_);
    int lines_failed = 0;
    lines_ = board::linux::take_over_safe_lines(layout, lines_failed);
    const Nanoseconds took = monotonic_now() - from;

    const bool hung = watched.outcome == Outcome::hung;
    layout.sketch_dead.store(
        static_cast<std::uint32_t>(hung ? board::linux::SketchDeath::hung : board::linux::SketchDeath::died));
    if (!options_.link.empty()) mark_link_dead(options_.link, sketch, hung);
    put_machine_back();
    report(watched, sketch, pins, lines_failed, took);
}

/// Undoes what the dead sketch had changed on the machine (owned cores, routed interrupts).
void Supervisor::put_machine_back() const {
    const auto restored = board::linux::restore_settings(options_.settings_state);
    if (restored) return;
    // Not ours to undo: another sketch's, or root's.
    const ErrorCode code = restored.error().code;
    if (code == ErrorCode::unavailable || code == ErrorCode::not_permitted) return;
    std::fprintf(stderr, "qduino-supervisor: the machine's settings are not as before: %s\n",
                 std::string{restored.error().message.view()}.c_str());
}

void Supervisor::report(const Watched& watched, pid_t sketch, int pins, int lines_failed,
                        Nanoseconds took) const {
    char how[128];
    if (watched.outcome == Outcome::hung && watched.hung_loop != board::kNoVcpu) {
        std::snprintf(how, sizeof how,
                      "loop %d hung (noticed %.2f ms after its heartbeat was due); the sketch was killed",
                      static_cast<int>(watched.hung_loop), to_seconds(watched.overdue) * 1e3);
    } else if (watched.outcome == Outcome::hung) {
        std::snprintf(how, sizeof how, "it did not stop when asked to, and was killed");
    } else if (watched.ending.by_signal) {
        std::snprintf(how, sizeof how, "it died of signal %d (%s)", watched.ending.status,
                      ::strsignal(watched.ending.status));
    } else {
        std::snprintf(how, sizeof how, "it ended with status %d", watched.ending.status);
    }
    std::fprintf(stderr, "qduino-supervisor: sketch %d: %s; %d pins forced to their safe states in %.2f ms\n",
                 static_cast<int>(sketch), how, pins, to_seconds(took) * 1e3);
    if (lines_failed > 0) {
        std::fprintf(stderr,
                     "qduino-supervisor: %d GPIO lines could NOT be taken over: switch the machine off\n",
                     lines_failed);
    }
}

void mark_link_dead(const std::string& path, pid_t sketch, bool hung) {
    using printer::link::LinkLayout;
    const board::linux::UniqueFd fd{::open(path.c_str(), O_RDWR | O_CLOEXEC)};
    struct stat status {};
    if (!fd.valid() || ::fstat(fd.get(), &status) != 0) return;
    if (status.st_size < static_cast<off_t>(sizeof(LinkLayout))) return;
    auto mapping = board::linux::map_shared(fd.get(), 0, sizeof(LinkLayout), false);
    if (!mapping) return;
    auto& link = *mapping->as<LinkLayout>();
    if (link.magic.load(std::memory_order_acquire) != printer::link::kMagic) return;
    if (link.version != printer::link::kVersion || link.size != sizeof(LinkLayout)) return;
    // Another living sketch's link is not ours to close; the sketch may be a child of what we started (a script).
    const auto owner = static_cast<pid_t>(link.sketch_pid);
    if (owner != sketch && owner > 0 && ::kill(owner, 0) == 0) return;
    link.sketch_dead.store(hung ? 2 : 1, std::memory_order_release);
}

}  // namespace qduino::supervisor
