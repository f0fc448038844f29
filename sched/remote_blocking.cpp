#include "sched/remote_blocking.h"

#include <algorithm>
#include <array>

#include "sched/completion_time.h"
#include "sched/exact.h"

namespace qduino::sched {
namespace {

constexpr int kSteps = 400;
constexpr std::size_t kLoopLimit = 4 * kMainVcpuLimit;
using Locks = std::uint32_t;  // a bit each

/// A loop with critical sections, and where it is.
struct Member {
    const Vcpu* loop = nullptr;
    std::size_t core = 0;  // index of its load
    Locks group = 0;       // its locks, and all that are connected with them
    int requests = 0;
    Nanoseconds locked{};  // what a release executes with any lock
    bool crosses = false;  // its group is on several cores
};
using Members = FixedVector<Member, kLoopLimit>;

Member member_of(const Vcpu& loop, std::size_t core, const CoreLoad& load) {
    Member member{.loop = &loop, .core = core};
    for (const CriticalSection& section : load.sections) {
        if (section.loop != loop.id || section.length <= Nanoseconds{0} || section.assumed) continue;
        member.group |= Locks{1} << section.lock;
        ++member.requests;
        member.locked += section.length;
    }
    // A section is part of what the budget pays for; a wait in it may cost the platform something.
    member.locked = std::min(member.locked, loop.budget) + member.requests * load.overheads.wait_cost;
    return member;
}

/// Locks that a loop takes are connected; so are those of a loop that takes one of them.
void connect(Members& members) {
    for (bool changed = true; changed;) {
        changed = false;
        for (Member& a : members) {
            for (const Member& b : members) {
                if (!(a.group & b.group) || !(b.group & ~a.group)) continue;
                a.group |= b.group;
                changed = true;
            }
        }
    }
    for (Member& a : members) {
        a.crosses = std::ranges::any_of(
            members, [&](const Member& b) { return a.group == b.group && a.core != b.core; });
    }
}

Members members_of(std::span<const CoreLoad> loads) {
    Members members;
    for (std::size_t core = 0; core < loads.size(); ++core) {
        for (const Vcpu& loop : loads[core].mains) {
            const Member member = member_of(loop, core, loads[core]);
            if (member.requests > 0) members.push_back(member);
        }
    }
    connect(members);
    return members;
}

/// All cores, and what is the same for every waiter.
struct Computer {
    std::span<CoreLoad> loads;
    Members members;
    bool all_above = false;  ///< there are too few priorities to say who is above whom
    std::array<bool, kCoreLimit> keeps_for_others{};
    /// By core and place in the load: within how long a release ends. The period, where that
    /// depends on waits for other cores, or the server allows it.
    std::array<std::array<Nanoseconds, kMainVcpuLimit>, kCoreLimit> ends_within{};
};

/// The waits of one loop.
class Waiter {
  public:
    Waiter(const Computer& computer, const Member& self) : computer_(computer), self_(self) {
        for (const Member& other : computer.members) {
            if (&other == &self || other.group != self.group) continue;
            const Vcpu*& lowest = lowest_[other.core];
            if (!lowest || ranks_above(*lowest, *other.loop)) lowest = other.loop;
        }
        for (std::size_t core = 0; core < computer.loads.size(); ++core) {
            if (!lowest_[core]) continue;
            for (const Vcpu& loop : computer.loads[core].mains) list(loop, core);
        }
    }

    /// How long.
    [[nodiscard]] RemoteWaits waits() const {
        RemoteWaits found;
        const Nanoseconds period = self_.loop->period;
        Nanoseconds window{1};
        for (int step = 0; step < kSteps && window <= period; ++step) {
            const Nanoseconds held = held_up(window, true);
            if (held < window) {
                found.longest = window;
                found.each = held_up(window, false);
                return found;
            }
            window = held + Nanoseconds{1};
        }
        found.longest = found.each = kResponseLimit * period + Nanoseconds{1};
        return found;
    }

  private:
    /// A loop that executes so much in a release, with the waiter's rank or a higher one.
    struct Executor {
        Nanoseconds amount{};
        Nanoseconds jitter{};
        Divisor period;
        bool own_core = false;
    };

    void list(const Vcpu& loop, std::size_t core) {
        const Member* found = member(loop);
        if (found == &self_) return;
        const Nanoseconds locked = found ? found->locked : Nanoseconds{0};
        if (found && holds_first(*found)) {
            Nanoseconds& longest = longest_below_[core == self_.core ? 1 : 0];
            longest = std::max(longest, locked);
            return;
        }
        const bool whole = is_above(loop, core) && ranks_above(loop, *lowest_[core]);
        const CoreLoad& load = computer_.loads[core];
        const Nanoseconds amount = whole ? cost_of(loop, found ? found->requests : 0, load) : locked;
        if (amount == Nanoseconds{0}) return;
        executors_.push_back({.amount = amount,
                              .jitter = std::max(ends_within(loop, core) - amount, Nanoseconds{0}),
                              .period = Divisor{loop.period},
                              .own_core = core == self_.core});
    }
    [[nodiscard]] Nanoseconds ends_within(const Vcpu& loop, std::size_t core) const {
        return computer_
            .ends_within[core][static_cast<std::size_t>(&loop - computer_.loads[core].mains.begin())];
    }
    /// Σ H_m(i, window), with the waiter's own core or without.
    [[nodiscard]] Nanoseconds held_up(Nanoseconds window, bool own_core) const {
        Nanoseconds sum = own_core ? std::max(longest_below_[0], longest_below_[1]) : longest_below_[0];
        for (const Executor& each : executors_) {
            if (own_core || !each.own_core) sum += each.period.ceil(window + each.jitter) * each.amount;
        }
        for (std::size_t core = 0; core < computer_.loads.size(); ++core) {
            if (lowest_[core] && (own_core || core != self_.core)) sum += executed_beside(core, window);
        }
        return sum;
    }
    /// By bottom halves and the platform.
    [[nodiscard]] Nanoseconds executed_beside(std::size_t core, Nanoseconds window) const {
        const CoreLoad& load = computer_.loads[core];
        Nanoseconds sum{};
        for (const Vcpu& io : load.ios) sum += most_services(io, core, window);
        const PlatformOverheads overheads = load.all_overheads();
        for (const PlatformInterferer& each : overheads.interferers)
            sum += each.interference(window) + each.cost;
        if (computer_.keeps_for_others[core]) {
            const PlatformInterferer kept = load.overheads.kept();
            sum += kept.interference(window) + kept.cost;
        }
        return sum;
    }
    /// With one lock alone, a lower loop can have it before the waiter only if it has it already.
    [[nodiscard]] bool holds_first(const Member& other) const {
        const bool one_lock = (self_.group & (self_.group - 1)) == 0;
        return one_lock && other.group == self_.group && !is_above(*other.loop, other.core);
    }
    /// Loops of one period on different cores may have one priority.
    [[nodiscard]] bool is_above(const Vcpu& loop, std::size_t core) const {
        if (computer_.all_above) return true;
        return core == self_.core ? ranks_above(loop, *self_.loop) : loop.period <= self_.loop->period;
    }
    [[nodiscard]] static Nanoseconds cost_of(const Vcpu& loop, int requests, const CoreLoad& load) {
        return loop.budget + load.allowance_of(loop) + load.overheads.per_release(loop, requests);
    }
    [[nodiscard]] const Member* member(const Vcpu& loop) const {
        const auto* const found = std::ranges::find(computer_.members, &loop, &Member::loop);
        return found == computer_.members.end() ? nullptr : found;
    }
    [[nodiscard]] Nanoseconds most_services(const Vcpu& io, std::size_t core, Nanoseconds window) const {
        Nanoseconds most{};
        const Nanoseconds overhead = computer_.loads[core].overheads.per_activation();
        const auto serve = [&](Nanoseconds client) {
            if (!computer_.all_above && client > self_.loop->period) return;
            const Nanoseconds service = service_of(io, client, overhead);
            const Nanoseconds rest = std::max(window - service, Nanoseconds{0});
            most = std::max(most, (2 + div_ceil(rest.count(), client.count())) * service);
        };
        if (io.client_period > Nanoseconds{0}) {
            serve(io.client_period);
        } else {
            for (const Vcpu& client : computer_.loads[core].mains) serve(client.period);
        }
        return most;
    }

    const Computer& computer_;
    const Member& self_;
    std::array<const Vcpu*, kCoreLimit> lowest_{};  // of the other holders on each core
    FixedVector<Executor, kLoopLimit> executors_;
    std::array<Nanoseconds, 2> longest_below_{};  // of one lock alone: on other cores, on its own
};

/// What lower loops of the core of `loop` execute with locks at the rank of loops that wait
/// elsewhere.
Nanoseconds lifted_over(const Vcpu& loop, std::size_t core, const Computer& computer) {
    Nanoseconds sum{};
    for (const Member& lower : computer.members) {
        if (lower.core != core || !lower.crosses || !ranks_above(loop, *lower.loop)) continue;
        const bool may_be = std::ranges::any_of(computer.members, [&](const Member& waiter) {
            return &waiter != &lower && waiter.group == lower.group &&
                   (computer.all_above || waiter.loop->period <= loop.period);
        });
        if (may_be) sum += lower.locked;
    }
    return sum;
}

/// The waiters: how often each waits, and what is lifted over each; not yet for how long.
void note_waiters(Computer& computer) {
    for (std::size_t core = 0; core < computer.loads.size(); ++core) {
        for (const Vcpu& loop : computer.loads[core].mains) {
            const auto* const self = std::ranges::find(computer.members, &loop, &Member::loop);
            const bool waits = self != computer.members.end() && self->crosses;
            const Nanoseconds lifted = lifted_over(loop, core, computer);
            if (!waits && lifted == Nanoseconds{0}) continue;
            computer.loads[core].waits.push_back(
                {.loop = loop.id, .requests = waits ? self->requests : 0, .lifted = lifted});
        }
    }
}

/// What follows for one core, before it is known how long its loops wait.
void analyse(std::size_t core, Computer& computer) {
    const CoreLoad& load = computer.loads[core];
    const CompletionTime analysis{load};
    computer.keeps_for_others[core] = analysis.keeps_for_others();
    for (std::size_t i = 0; i < analysis.size(); ++i) {
        const Vcpu& loop = analysis.loop(i);
        const bool waits_elsewhere = load.waits_of(loop.id).requests > 0;
        const Nanoseconds end =
            waits_elsewhere || loop.deferrable ? loop.period : analysis.response(i, loop.period);
        const auto* const place = std::ranges::find(load.mains, loop.id, &Vcpu::id);
        computer.ends_within[core][static_cast<std::size_t>(place - load.mains.begin())] =
            std::min(end, loop.period);
    }
}

}  // namespace

bool locks_cross_cores(std::span<const CoreLoad> loads) {
    const Members members = members_of(loads);
    return std::ranges::any_of(members, &Member::crosses);
}

void count_remote_waits(std::span<CoreLoad> loads) {
    for (CoreLoad& load : loads) load.waits.clear();
    Computer computer{.loads = loads, .members = members_of(loads)};
    if (std::ranges::none_of(computer.members, &Member::crosses)) return;

    std::size_t vcpus = 0;
    for (const CoreLoad& load : loads) vcpus += load.mains.size() + load.ios.size();
    for (const CoreLoad& load : loads) computer.all_above |= vcpus > load.overheads.priorities;
    note_waiters(computer);
    for (const Member& member : computer.members) {
        if (computer.ends_within[member.core][0] == Nanoseconds{0}) analyse(member.core, computer);
    }
    for (const Member& member : computer.members) {
        if (!member.crosses) continue;
        const RemoteWaits found = Waiter{computer, member}.waits();
        RemoteWaits& waits =
            *std::ranges::find(loads[member.core].waits, member.loop->id, &RemoteWaits::loop);
        waits.longest = found.longest;
        waits.each = found.each;
    }
}

FixedVector<VcpuId, kMainVcpuLimit> remote_sharers(std::span<const CoreLoad> loads, VcpuId loop) {
    FixedVector<VcpuId, kMainVcpuLimit> sharers;
    const Members members = members_of(loads);
    const auto* const self =
        std::ranges::find_if(members, [loop](const Member& member) { return member.loop->id == loop; });
    if (self == members.end() || !self->crosses) return sharers;
    for (const Member& other : members) {
        if (&other != self && other.group == self->group)
            static_cast<void>(sharers.try_push_back(other.loop->id));
    }
    return sharers;
}

}  // namespace qduino::sched
