#include "apps/supervisor/hang.h"

#include "base/text.h"
#include "terminal/human.h"

namespace qduino::supervisor {
namespace {

using board::Heartbeat;
using board::PinsLayout;
using board::VcpuId;

/// One that announces a wake-up further away sleeps; one that wakes sooner polls.
constexpr Nanoseconds kSleepsAtLeast = 1s;

/// Beyond this a sleep has no end that anybody meant.
constexpr Nanoseconds kNoEnd = 8760h;

std::int64_t ns_of(const std::atomic<std::int64_t>& ns) { return ns.load(std::memory_order_relaxed); }

std::string name_of(VcpuId vcpu) {
    if (vcpu == board::kNoVcpu) return "setup()";
    return text<std::string>(vcpu < board::kFirstIoVcpu ? "loop " : "the handlers of io ", vcpu);
}

/// "2 min 5 s", "9 h 59 min".
std::string long_duration(Nanoseconds duration) {
    const std::int64_t s = duration / 1s;
    if (s < 120) return apps::human_duration(duration);
    if (s < 7200) return text<std::string>(s / 60, " min ", s % 60, " s");
    return text<std::string>(s / 3600, " h ", s / 60 % 60, " min");
}

std::string what_it_does(const Hang& hang, Instant now) {
    if (hang.vcpu == board::kNoVcpu) return "it waits or polls for something that does not come";
    const Nanoseconds sleeps = hang.heard_of - now;
    if (sleeps > kNoEnd) return "it waits without end";
    if (sleeps > kSleepsAtLeast) {
        return text<std::string>("it sleeps for another ", long_duration(sleeps), ", in a delay()");
    }
    return "it polls: it runs or waits shortly, and does not end its release";
}

Hang find_lost_warden(const PinsLayout& layout, Instant now, const Pauses& pauses) {
    if (layout.warden.load() == 0 || layout.warden_by_ns.load() == board::kWardenLeft) return {};
    const Instant by = pauses.end_of_wardens_look(layout);
    if (now <= by) return {};
    Hang hang;
    hang.kind = Hang::Kind::unwatched;
    hang.overdue = now - by;
    return hang;
}

}  // namespace

void Pauses::Promise::delay(std::int64_t now_by_ns, Nanoseconds turn) {
    longer = now_by_ns == by_ns ? longer + turn : turn;
    by_ns = now_by_ns;
}

Instant Pauses::Promise::end(std::int64_t now_by_ns) const {
    const Instant by = instant_from_ns(now_by_ns);
    // "None" and "without end" are no instants that could be later.
    if (now_by_ns != by_ns || by == kEpoch || by > kForever - longer) return by;
    return by + longer;
}

void Pauses::turn_took(const PinsLayout& layout, Nanoseconds turn) {
    if (turn <= kLongestTurn) return;
    for (VcpuId vcpu = 0; vcpu < board::kVcpuLimit; ++vcpu) {
        const Heartbeat& beat = layout.heartbeats[vcpu];
        beats_[vcpu].delay(ns_of(beat.expected_by_ns), turn);
        progress_[vcpu].delay(ns_of(beat.progress_by_ns), turn);
    }
    warden_.delay(layout.warden_by_ns.load(), turn);
}

Instant Pauses::end_of_beat(const PinsLayout& layout, VcpuId vcpu) const {
    return beats_[vcpu].end(ns_of(layout.heartbeats[vcpu].expected_by_ns));
}

Instant Pauses::end_of_progress(const PinsLayout& layout, VcpuId vcpu) const {
    return progress_[vcpu].end(ns_of(layout.heartbeats[vcpu].progress_by_ns));
}

Instant Pauses::end_of_wardens_look(const PinsLayout& layout) const {
    return warden_.end(layout.warden_by_ns.load());
}

Hang find_hang(const PinsLayout& layout, Instant now, Nanoseconds bound, const Pauses& pauses) {
    for (VcpuId vcpu = 1; vcpu < board::kVcpuLimit; ++vcpu) {
        const Instant by = pauses.end_of_beat(layout, vcpu);
        if (by == kEpoch || now <= by) continue;
        return {.kind = Hang::Kind::silent, .vcpu = vcpu, .overdue = now - by, .limit = {}, .heard_of = {}};
    }
    for (VcpuId vcpu = board::kNoVcpu; vcpu < board::kVcpuLimit; ++vcpu) {
        const Heartbeat& beat = layout.heartbeats[vcpu];
        const Instant by = pauses.end_of_progress(layout, vcpu);
        if (by == kEpoch || now <= by) continue;
        return {.kind = Hang::Kind::stuck,
                .vcpu = vcpu,
                .overdue = now - by,
                .limit = Nanoseconds{beat.progress_limit_ns.load(std::memory_order_relaxed)},
                .heard_of = instant_from_ns(ns_of(beat.expected_by_ns)) - bound};
    }
    return find_lost_warden(layout, now, pauses);
}

std::string hang_text(const Hang& hang, Instant now, bool core_was_taken) {
    if (hang.kind == Hang::Kind::unwatched) {
        return text<std::string>("its warden ",
                                 hang.dead ? "died"
                                           : "looked no more (noticed " + apps::human_duration(hang.overdue) +
                                                 " after it was due to)",
                                 ": nobody kept its loops to their budgets");
    }
    const std::string name = name_of(hang.vcpu);
    if (hang.kind == Hang::Kind::silent) {
        return text<std::string>(name, " hung (noticed ", apps::human_duration(hang.overdue),
                                 " after its heartbeat was due)");
    }
    return text<std::string>(name, " hung: no progress for ", apps::human_duration(hang.limit), " (noticed ",
                             apps::human_duration(hang.overdue), " later)",
                             core_was_taken ? "" : "; " + what_it_does(hang, now));
}

}  // namespace qduino::supervisor
