#include "apps/supervisor/supervisor.h"

#include <poll.h>
#include <signal.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstring>

#include "board/linux/kernel/clock.h"
#include "board/linux/kernel/core_rivals.h"
#include "board/linux/kernel/importance.h"
#include "board/linux/pin/death_witness.h"
#include "terminal/human.h"
#include "terminal/message.h"

namespace qduino::supervisor {
namespace {

using board::PinsLayout;
using board::SketchDeath;
using board::linux::block_until;
using board::linux::monotonic_now;
using board::linux::PinsFile;
using board::linux::PinsRole;

constexpr int kPollMs = 10;
/// A sketch that was asked to stop has this long; then it is killed.
constexpr Nanoseconds kStopGrace = 5s;
/// So many turns in a row without a warden (30 ms) are no accident.
constexpr int kTurnsUnwatched = 3;
constexpr Nanoseconds kFirstBackoff = 200ms;
constexpr Nanoseconds kLastBackoff = 5s;
/// A heat watch that dies at once is not started more often than this.
constexpr Nanoseconds kHeatWatchEvery = 1s;

void complain(std::string_view text) { apps::say(text, "qduino-supervisor: "); }

}  // namespace

Result<Supervisor> Supervisor::open(Options options, SystemCalls& system) {
    Supervisor supervisor{system};
    if (options.make_pins) {
        QDUINO_TRY_ASSIGN(supervisor.machine_role_, PinsFile::create(options.pins));
    }
    QDUINO_TRY_ASSIGN(supervisor.file_, PinsFile::open(options.pins, PinsRole::supervisor));
    if (!options.starter.empty()) {
        QDUINO_TRY_ASSIGN(supervisor.starter_, board::linux::Starter::open(options.starter));
    }
    supervisor.options_ = std::move(options);
    return supervisor;
}

int Supervisor::run(int signals) {
    auto opened = hands_.open(file_, board::kSupervisorWriter, options_.link, options_.sysfs_root, *system_);
    if (!opened) {
        complain(opened.error().message);
        return 1;
    }
    heat_watch_task_ = {&file_, options_.link, options_.settings_state, options_.sysfs_root,
                        options_.real_time};
    start_heat_watch();
    const int status = keep_running(signals);
    heat_watch_.end();
    return status;
}

void Supervisor::start_heat_watch() {
    renew_heat_watch_at_ = monotonic_now() + kHeatWatchEvery;
    if (auto started = heat_watch_.start(heat_watch_task_); !started)
        complain(text<std::string>(started.error().message, ": nobody watches the supervisor"));
}

/// Replaces a watch that has died. Meanwhile the sketch is watched at ordinary priority.
void Supervisor::renew_heat_watch() {
    importance::step_down();
    heat_watch_.end();
    complain("the heat watch died; another is started");
    start_heat_watch();
    if (options_.real_time) importance::rise(importance::kSupervisorPriority);
}

int Supervisor::keep_running(int signals) {
    Nanoseconds backoff = kFirstBackoff;
    for (;;) {
        PinsLayout& layout = file_.layout();
        layout.heartbeat_bound_ns.store(to_ns(options_.heartbeat_timeout));
        layout.witness.store(0);
        layout.warden.store(0);
        layout.warden_by_ns.store(0);
        warden_.reset();
        warden_pid_ = 0;
        turns_unwatched_ = 0;
        pauses_ = {};
        // Forgets the promises of an earlier sketch.
        for (auto& beat : layout.heartbeats) {
            beat.expected_by_ns.store(0);
            beat.progress_by_ns.store(0);
        }
        // The new sketch needs the lines.
        hands_.release_lines();
        auto sketch = SketchProcess::start(options_.command);
        if (!sketch) {
            complain(sketch.error().message);
            return 127;
        }
        const Instant started = monotonic_now();
        heat_watch_.sketch_is(sketch->pid());
        if (options_.real_time) importance::rise(importance::kSupervisorPriority);
        Watched watched = watch(*sketch, signals);
        outlive(watched, *sketch);
        const bool well = watched.outcome == Outcome::ended && watched.ending.exit_status() == 0;
        if (well || stop_asked_ || !options_.restart) return watched.ending.exit_status();

        if (monotonic_now() - started > kLastBackoff) backoff = kFirstBackoff;
        const Instant next = monotonic_now() + backoff;
        pollfd stop{signals, POLLIN, 0};
        if (system_->poll(&stop, 1, static_cast<int>(backoff / 1ms)) > 0) return watched.ending.exit_status();
        block_until(next);
        backoff = std::min(2 * backoff, kLastBackoff);
    }
}

// The witness counts only when it belongs to the very process that was started. If that is a
// script, the script decides what its child's death means.
bool Supervisor::is_dying(const SketchProcess& sketch) const {
    const PinsLayout& layout = file_.layout();
    const bool own = static_cast<pid_t>(layout.sketch_pid.load()) == sketch.pid();
    if (own && (layout.witness.load() & board::linux::kWitnessDied) != 0) return true;
    Ending ending;
    return sketch.ended(ending);
}

void Supervisor::hand_on_signal(const SketchProcess& sketch, int signals, Instant& kill_at) {
    signalfd_siginfo signal{};
    if (!system_->read_signal(signals, signal)) return;
    // Ctrl-C in a terminal reaches the sketch by itself; a second signal would mean "at once".
    if (signal.ssi_code != SI_KERNEL) system_->kill(sketch.descriptor(), static_cast<int>(signal.ssi_signo));
    stop_asked_ = true;
    kill_at = std::min(kill_at, monotonic_now() + kStopGrace);
}

Supervisor::Watched Supervisor::watch(const SketchProcess& sketch, int signals) {
    Watched watched;
    Instant kill_at = kForever;
    importance::Pace pace;
    Instant last_look = monotonic_now();
    for (;;) {
        pace.next_turn();
        heat_watch_.expect_beats(true);
        heat_watch_.beat();
        const bool may_renew = monotonic_now() >= renew_heat_watch_at_;
        std::array<pollfd, 3> events{{{sketch.descriptor(), POLLIN, 0},
                                      {signals, POLLIN, 0},
                                      {may_renew ? heat_watch_.descriptor() : -1, POLLIN, 0}}};
        system_->poll(events.data(), events.size(), kPollMs);
        if (is_dying(sketch)) return watched;
        if ((events[1].revents & POLLIN) != 0) hand_on_signal(sketch, signals, kill_at);
        if ((events[2].revents & POLLIN) != 0) renew_heat_watch();
        const Instant now = monotonic_now();
        pauses_.turn_took(file_.layout(), now - last_look);
        last_look = now;
        if (options_.heartbeat_timeout > Nanoseconds{0}) watched.hang = find_hang_now(now);
        const bool orphaned = starter_.is_dead();
        if (!watched.hang.found() && now < kill_at && !orphaned) continue;
        watched.ended_at = now;
        watched.outcome = orphaned ? Outcome::orphaned : Outcome::hung;
        stop_asked_ = stop_asked_ || orphaned;
        system_->kill(sketch.descriptor(), SIGKILL);
        return watched;
    }
}

/// A warden counts as lost when it was so in several turns: after a pause of the whole computer
/// this process may look before the warden does, and a sketch that ends leaves its warden to end,
/// too.
Hang Supervisor::find_hang_now(Instant now) {
    const PinsLayout& layout = file_.layout();
    if (const std::uint32_t warden = layout.warden.load(); warden_pid_ == 0 && warden != 0) {
        warden_pid_ = warden;
        warden_.reset(static_cast<int>(::syscall(SYS_pidfd_open, warden, 0)));
    }
    Hang hang = find_hang(layout, now, options_.heartbeat_timeout, pauses_);
    pollfd dead{warden_.get(), POLLIN, 0};
    const bool died = warden_.valid() && layout.warden_by_ns.load() != board::kWardenLeft &&
                      ::poll(&dead, 1, 0) > 0 && (dead.revents & POLLIN) != 0;
    if (died && !hang.found()) hang.kind = Hang::Kind::unwatched;
    if (hang.kind != Hang::Kind::unwatched) {
        turns_unwatched_ = 0;
        return hang;
    }
    hang.dead = died;
    return ++turns_unwatched_ < kTurnsUnwatched ? Hang{} : hang;
}

/// From a sketch that is dead, or as good as dead, to a computer as it was before. The order
/// matters: see the head of supervisor.h.
void Supervisor::outlive(Watched& watched, const SketchProcess& sketch) {
    const Dying dying{sketch.descriptor(), sketch.pid()};
    const bool hung = watched.outcome == Outcome::hung;
    watched.cut = hands_.cut(dying, hung ? SketchDeath::hung : SketchDeath::died);
    heat_watch_.expect_beats(false);
    importance::step_down();

    watched.core_taken = find_who_took_its_core(watched, sketch);
    // The explanation of a hang does not wait until the sketch is gone.
    if (hung) explain(watched, sketch.pid());
    hands_.outlast(dying, watched.cut);
    static_cast<void>(sketch.ended(watched.ending));
    if (!hung) explain(watched, sketch.pid());
    system_->reap(sketch.pid());
    put_computer_back();
    report(watched, sketch.pid());
    heat_watch_.sketch_is(0);
}

/// Undoes what the dead sketch had changed on the computer (owned cores, routed interrupts).
void Supervisor::put_computer_back() const {
    const auto restored = board::linux::restore_settings(options_.settings_state);
    if (restored) return;
    // These changes belong to another sketch, or to root.
    const ErrorCode code = restored.error().code;
    if (code == ErrorCode::unavailable || code == ErrorCode::not_permitted) return;
    complain(text<std::string>("the machine's settings are not as before: ", restored.error().message));
}

/// Finds the task that took the core of a loop that hung, or of any loop of a sketch that was
/// killed. That task may have kept the sketch from dying, and will keep the next one from running.
std::string Supervisor::find_who_took_its_core(const Watched& watched, const SketchProcess& sketch) const {
    const PinsLayout& layout = file_.layout();
    // A loop whose core was taken may have missed either promise first.
    if (watched.hang.found() && watched.hang.vcpu != board::kNoVcpu)
        return board::linux::who_took_the_core_of(watched.hang.vcpu, layout, sketch.pid());
    Ending ending;
    const bool ended_by_itself = sketch.ended(ending) && !ending.by_signal;
    return ended_by_itself ? "" : board::linux::who_took_a_core_of(layout, sketch.pid());
}

std::string Supervisor::how_it_ended(const Watched& watched) {
    const std::string& core_taken = watched.core_taken;
    const std::string because = core_taken.empty() ? "" : ": " + core_taken;
    if (watched.outcome == Outcome::orphaned)
        return "the program that started it died, and the sketch was ended at once";
    if (watched.hang.found())
        return hang_text(watched.hang, watched.ended_at, !core_taken.empty()) + "; the sketch was killed" +
               because;
    if (watched.outcome == Outcome::hung) return "it did not stop when asked to, and was killed" + because;
    const int status = watched.ending.status;
    if (!watched.ending.by_signal) return text<std::string>("it ended with status ", status);
    return text<std::string>("it died of signal ", status, " (", ::strsignal(status), ')',
                             core_taken.empty() ? "" : "; meanwhile ", core_taken);
}

/// The explanation for the print service: how the sketch ended and, where a real-time task took a
/// core of it, which one. Called once for each sketch, at ordinary priority, after its machine is
/// safe and before it is reaped. At most 235 bytes are kept.
void Supervisor::explain(const Watched& watched, pid_t sketch) const {
    if (!options_.link.empty()) write_death_note(options_.link, sketch, how_it_ended(watched));
}

void Supervisor::report(const Watched& watched, pid_t sketch) const {
    const auto& outputs = watched.cut.outputs;
    complain(text<std::string>("sketch ", sketch, ": ", how_it_ended(watched), "; ",
                               apps::counted(outputs.pins, "pin"), " forced to safe states in ",
                               apps::human_duration(watched.cut.took)));
    // The heat watch holds the lines that it has taken over.
    if (outputs.lines_missing > 0 && !heat_watch_.has_cut(sketch))
        complain(text(outputs.lines_missing, " GPIO lines could NOT be taken over: switch the machine off"));
    if (outputs.channels_failed > 0)
        complain(
            text(outputs.channels_failed, " PWM channels could NOT be switched off: switch the machine off"));
    if (importance::budget_was_spent())
        complain("it had spent its real-time budget, and went on at ordinary priority");
}

}  // namespace qduino::supervisor
