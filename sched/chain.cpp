#include "sched/chain.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "base/contract.h"
#include "sched/admission.h"
#include "sched/remote_blocking.h"

namespace qduino::sched {
namespace {

/// A stage with its times.
struct TimedStage {
    ChainStage stage;
    Vcpu vcpu;
    const CoreLoad* load = nullptr;
    Nanoseconds period{};    ///< from one begin to the next; 0: it begins with its edge
    Nanoseconds response{};  ///< from its begin, or its edge, to its end
    /// It begins at whole periods from the common origin.
    [[nodiscard]] bool released() const { return !vcpu.is_io() && stage.pass == Nanoseconds{0}; }
};
using TimedStages = FixedVector<TimedStage, kChainStageLimit>;

ChainFault time_loop(const Admission& core, TimedStage& timed) {
    const Vcpu& loop = timed.vcpu;
    timed.period = timed.response = timed.stage.pass;
    if (timed.stage.pass > Nanoseconds{0})
        return core.by == AdmittedBy::owned ? ChainFault::none : ChainFault::no_period;
    const auto* const found = std::ranges::find(core.loops, loop.id, &LoopResponse::id);
    if (found == core.loops.end() || !found->meets()) return ChainFault::never_in_time;
    timed.period = loop.period;
    timed.response = found->response;
    return ChainFault::none;
}

ChainFault time_bottom_half(const Admission& core, TimedStage& timed) {
    const auto* const found = std::ranges::find(core.ios, timed.vcpu.id, &IoResponse::id);
    if (found == core.ios.end() || found->response > kResponseLimit * found->replenishment)
        return ChainFault::never_in_time;
    timed.response = found->replenishment + found->response;
    return ChainFault::none;
}

ChainFault time_stage(const MulticoreAdmission& admission, const ChainStage& stage, TimedStage& timed) {
    timed.stage = stage;
    for (const CoreLoad& load : admission.loads) {
        const auto& core = admission.cores[static_cast<std::size_t>(load.core)];
        timed.load = &load;
        if (const auto* const loop = std::ranges::find(load.mains, stage.vcpu, &Vcpu::id);
            loop != load.mains.end()) {
            timed.vcpu = *loop;
            return time_loop(core, timed);
        }
        if (const auto* const io = std::ranges::find(load.ios, stage.vcpu, &Vcpu::id); io != load.ios.end()) {
            timed.vcpu = *io;
            return time_bottom_half(core, timed);
        }
    }
    return ChainFault::no_such_vcpu;
}

/// No release of `j` that begins behind one of `i` reads before that one has ended: they share a
/// core, `i` goes first, and never gives the core up.
bool is_done_before(const TimedStage& i, const TimedStage& j) {
    if (!i.released() || !j.released() || i.load != j.load || !ranks_above(i.vcpu, j.vcpu)) return false;
    const auto above =
        std::ranges::count_if(i.load->mains, [&](const Vcpu& other) { return ranks_above(other, i.vcpu); });
    const std::size_t ios = i.load->ios.size(), priorities = i.load->overheads.priorities;
    const bool own_priority =
        i.load->mains.size() + ios <= priorities || static_cast<std::size_t>(above) + 1 + ios < priorities;
    return own_priority && i.vcpu.suspension == Nanoseconds{0} && i.load->waits_of(i.vcpu.id).requests == 0;
}

/// How far the releases of two stages can be apart, if it is less than `distance` or as much.
Nanoseconds on_the_grid(const TimedStage& i, const TimedStage& j, Nanoseconds distance) {
    if (!i.released() || !j.released()) return distance;
    const Nanoseconds grid{std::gcd(i.period.count(), j.period.count())};
    return distance / grid * grid;
}

/// D(i,j).
Nanoseconds forward_step(const TimedStage& i, const TimedStage& j) {
    return on_the_grid(i, j, j.period + (is_done_before(i, j) ? Nanoseconds{0} : i.response));
}

/// A(i,j).
Nanoseconds backward_step(const TimedStage& i, const TimedStage& j) {
    const Nanoseconds sampled =
        on_the_grid(i, j, i.period + (is_done_before(i, j) ? Nanoseconds{0} : i.response));
    return j.stage.queued ? std::max(sampled, forward_step(i, j)) : sampled;
}

ChainBound bound_of(const TimedStages& stages) {
    ChainBound bound;
    bound.has_age = !stages.front().vcpu.is_io();
    bound.last = stages.back().response;
    bound.reaction = bound.age = bound.last;
    for (std::size_t k = 0; k < stages.size(); ++k) {
        const bool first = k == 0;
        bound.reaction_steps.push_back(first ? stages[k].period : forward_step(stages[k - 1], stages[k]));
        bound.age_steps.push_back(first ? Nanoseconds{0} : backward_step(stages[k - 1], stages[k]));
        bound.reaction += bound.reaction_steps.back();
        bound.age += bound.age_steps.back();
    }
    if (!bound.has_age) bound.age = Nanoseconds{0};
    return bound;
}

Vcpu* loop_in(MulticoreAdmission& admission, VcpuId id) {
    for (CoreLoad& load : admission.loads) {
        if (auto* const loop = std::ranges::find(load.mains, id, &Vcpu::id); loop != load.mains.end())
            return loop;
    }
    return nullptr;
}

/// Every loop is admitted with `period`, and the chain keeps its limits. Leaves `loop` so.
bool holds_with(MulticoreAdmission& scratch, const ChainStages& stages, const ChainLimits& limits, Vcpu& loop,
                Nanoseconds period) {
    if (period < loop.budget) return false;
    loop.period = period;
    if (!are_admissible(scratch.loads)) return false;
    for (const CoreLoad& load : scratch.loads) {
        if (!load.mains.empty() || !load.ios.empty())
            scratch.cores[static_cast<std::size_t>(load.core)] = admit_without_remedy(load);
    }
    return limits.hold(bound_of(scratch, stages));
}

Nanoseconds in_microseconds(Nanoseconds time) { return time / 1us * Nanoseconds{1000}; }

/// One that `holds`, up to `most`, where `least` does; the longest if every shorter one does. All
/// in whole microseconds.
template <typename Holds>
Nanoseconds bisect(Nanoseconds least, Nanoseconds most, Holds holds) {
    while (most - least > 1us) {
        const Nanoseconds middle = in_microseconds((least + most) / 2);
        (holds(middle) ? least : most) = middle;
    }
    return least;
}

}  // namespace

ChainBound bound_of(const MulticoreAdmission& admission, const ChainStages& stages) {
    QDUINO_EXPECT(!stages.empty());
    TimedStages timed;
    for (const ChainStage& stage : stages) {
        timed.push_back({});
        ChainFault fault = time_stage(admission, stage, timed.back());
        if (timed.size() > 1 && timed.back().vcpu.is_io()) fault = ChainFault::io_behind;
        if (fault == ChainFault::none) continue;
        ChainBound bound;
        bound.fault = fault;
        bound.at = stage.vcpu;
        return bound;
    }
    return bound_of(timed);
}

Nanoseconds longest_period(MulticoreAdmission& scratch, const ChainStages& stages, const ChainLimits& limits,
                           VcpuId id) {
    Vcpu* const loop = loop_in(scratch, id);
    if (!loop || (loop->parameters().whole_core() && loop->core != kAnyCore)) return Nanoseconds{0};
    const Nanoseconds before = loop->period;
    const auto holds = [&](Nanoseconds period) {
        return period <= kPeriodMax && holds_with(scratch, stages, limits, *loop, period);
    };
    // From one that holds on: with a period that is too short nothing is admitted.
    Nanoseconds at_least = in_microseconds(before);
    while (at_least >= loop->budget && !holds(at_least)) at_least = in_microseconds(at_least * 3 / 4);
    Nanoseconds longest{};
    if (at_least >= loop->budget)
        longest =
            bisect(at_least, in_microseconds(std::max({limits.reaction, limits.age, before})) + 1us, holds);
    constexpr int kParts = 16;
    const auto consider = [&](Nanoseconds period) {
        if (period > longest && period % 1us == Nanoseconds{0} && holds(period)) longest = period;
    };
    for (const ChainStage& stage : stages) {
        const Vcpu* const other = loop_in(scratch, stage.vcpu);
        if (!other || other == loop || stage.pass > Nanoseconds{0}) continue;
        for (int n = 1; n <= kParts; ++n) {
            consider(other->period * n);
            consider(other->period / n);
        }
    }
    holds(before);  // everything as it was
    loop->period = before;
    return longest;
}

}  // namespace qduino::sched
