#include "board/linux/loop/crew.h"

#include <algorithm>
#include <array>
#include <set>
#include <utility>

#include "board/linux/kernel/cycle_clock.h"
#include "board/linux/kernel/futex.h"
#include "board/linux/kernel/real_time_thread.h"

namespace qduino::board::linux {

Result<void> check_specs(std::span<const VcpuSpec> specs, const LinuxConfig& config, int core_count) {
    std::array<bool, kVcpuLimit> taken{};
    for (const VcpuSpec& spec : specs) {
        const bool sound = spec.id != kNoVcpu && spec.id < kVcpuLimit && !taken[spec.id] && spec.core >= 0 &&
                           spec.core < core_count && spec.parameters().valid() &&
                           (spec.entry || spec.is_io());
        if (!sound) {
            return make_error(
                ErrorCode::invalid_argument, "loop ", spec.id,
                ": id taken or out of range, no such core, budget not within its period, or no body");
        }
        taken[spec.id] = true;
        const bool shares = std::any_of(specs.begin(), specs.end(), [&](const VcpuSpec& other) {
            return other.id != spec.id && other.core == spec.core;
        });
        if (config.enforce_budgets && shares && !spec.owns_core && spec.budget < kShortestSharedBudget) {
            return make_error(
                ErrorCode::out_of_range, "loop ", spec.id,
                " has a budget below 100 us on a core that others use: enforcing it would cost more than the "
                "budget. Give it its own core (budget = period), or make budget and period longer");
        }
    }
    return {};
}

namespace {

/// Period, and the place among those of one period on its core. Loops of different cores share a
/// priority, so that a lock's holder can inherit from another core. Loops of one core do not: the
/// kernel would run them in turns, and admission has them in order.
using Rank = std::pair<Nanoseconds, std::ptrdiff_t>;

Nanoseconds rank_period(const VcpuSpec& spec) {
    return spec.client_period > Nanoseconds{0} ? spec.client_period : spec.period;
}

Rank rank_of(const VcpuSpec& spec, std::span<const VcpuSpec> all) {
    return {rank_period(spec), std::ranges::count_if(all, [&](const VcpuSpec& other) {
                return other.core == spec.core && rank_period(other) == rank_period(spec) &&
                       other.id < spec.id;
            })};
}

}  // namespace

int priority_of(const VcpuSpec& spec, std::span<const VcpuSpec> all, const LinuxConfig& config) {
    if (!config.real_time) return 0;
    std::set<Rank> ranks, on_its_core;
    for (const VcpuSpec& other : all) {
        const Rank rank = rank_of(other, all);
        ranks.insert(rank);
        if (other.core == spec.core) on_its_core.insert(rank);
    }
    const auto enough = static_cast<std::size_t>(config.priority_highest - config.priority_lowest + 1);
    const std::set<Rank>& told_apart = ranks.size() <= enough ? ranks : on_its_core;
    const auto higher = std::distance(told_apart.begin(), told_apart.find(rank_of(spec, all)));
    return std::max(config.priority_lowest, config.priority_highest - static_cast<int>(higher));
}

Result<void> Crew::add(const VcpuSpec& spec, VcpuThreadOptions options) {
    options.gate = &gate_;
    options.returned = &returned_;
    threads_.push_back(std::make_unique<VcpuThread>(spec, options));
    Result<void> made = threads_.back()->create();
    if (made) return made;
    threads_.pop_back();
    open_gate(2);
    join();
    return made;
}

std::optional<VcpuSpec> Crew::wait_until_ready(Nanoseconds patience) {
    constexpr Nanoseconds kLookEvery = 50ms, kAfterStop = 1s;
    Instant until = monotonic_now() + patience;
    bool stopping = false;
    for (std::uint32_t ready = 0; (ready = gate_.ready.load()) < threads_.size();) {
        const Instant now = monotonic_now();
        if (!stopping && stop_.load(std::memory_order_acquire)) {
            stopping = true;
            until = std::min(until, now + kAfterStop);
        }
        if (now >= until) break;
        futex_wait_until(gate_.ready, ready, std::min(until, now + kLookEvery));
    }
    const auto missing =
        std::ranges::find_if(threads_, [](const auto& thread) { return !thread->at_gate(); });
    if (missing == threads_.end()) return std::nullopt;
    const VcpuSpec spec = (*missing)->spec();
    send_home();
    return spec;
}

/// Those that cannot run where they should end elsewhere: they could not be joined.
void Crew::send_home() {
    open_gate(2);
    static_cast<void>(wait_or_free([this] { return all_returned(); }, monotonic_now(),
                                   [](Instant until) { block_until(until); },
                                   [this] {
                                       for (const auto& thread : threads_) thread->leave_core();
                                   }));
    if (all_returned()) join();
}

void Crew::open_gate(std::uint32_t state) {
    gate_.state.store(state, std::memory_order_release);
    futex_wake_all(gate_.state);
}

bool Crew::all_returned() const {
    return std::all_of(threads_.begin(), threads_.end(),
                       [](const auto& thread) { return thread->returned(); });
}

bool Crew::wait_until(Instant until, const std::function<void()>& when_woken) {
    for (;;) {
        const std::uint32_t seen = returned_.load();
        if (woken_.exchange(false)) when_woken();
        if (stop_.load(std::memory_order_acquire) && all_returned()) return true;
        if (cycle_clock.now() >= until) return false;
        futex_wait_until(returned_, seen, until);
    }
}

void Crew::wake() {
    woken_.store(true, std::memory_order_release);
    returned_.fetch_add(1);
    futex_wake_all(returned_);
}

void Crew::request_stop() {
    stop_.store(true, std::memory_order_release);
    returned_.fetch_add(1);
    futex_wake_all(returned_);
}

}  // namespace qduino::board::linux
