#include "apps/supervisor/hang.h"

#include "apps/terminal/human.h"
#include "base/text.h"

namespace qduino::supervisor {
namespace {

using board::Heartbeat;
using board::PinsLayout;
using board::VcpuId;

/// One that announces a wake-up further away sleeps; one that wakes sooner polls.
constexpr Nanoseconds kSleepsAtLeast = 1s;

/// Beyond this a sleep has no end that anybody meant.
constexpr Nanoseconds kNoEnd = 8760h;

Instant instant_of(const std::atomic<std::int64_t>& ns) {
    return instant_from_ns(ns.load(std::memory_order_relaxed));
}

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

Hang find_lost_warden(const PinsLayout& layout, Instant now) {
    const std::int64_t by = layout.warden_by_ns.load();
    if (layout.warden.load() == 0 || by == board::kWardenLeft || to_ns(now) <= by) return {};
    Hang hang;
    hang.kind = Hang::Kind::unwatched;
    hang.overdue = now - instant_from_ns(by);
    return hang;
}

}  // namespace

Hang find_hang(const PinsLayout& layout, Instant now, Nanoseconds bound) {
    for (VcpuId vcpu = 1; vcpu < board::kVcpuLimit; ++vcpu) {
        const Instant by = instant_of(layout.heartbeats[vcpu].expected_by_ns);
        if (by == kEpoch || now <= by) continue;
        return {.kind = Hang::Kind::silent, .vcpu = vcpu, .overdue = now - by, .limit = {}, .heard_of = {}};
    }
    for (VcpuId vcpu = board::kNoVcpu; vcpu < board::kVcpuLimit; ++vcpu) {
        const Heartbeat& beat = layout.heartbeats[vcpu];
        const Instant by = instant_of(beat.progress_by_ns);
        if (by == kEpoch || now <= by) continue;
        return {.kind = Hang::Kind::stuck,
                .vcpu = vcpu,
                .overdue = now - by,
                .limit = Nanoseconds{beat.progress_limit_ns.load(std::memory_order_relaxed)},
                .heard_of = instant_of(beat.expected_by_ns) - bound};
    }
    return find_lost_warden(layout, now);
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
