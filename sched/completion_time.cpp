#include "sched/completion_time.h"

#include <algorithm>
#include <tuple>

#include "base/contract.h"
#include "sched/exact.h"

namespace qduino::sched {
namespace {

/// Rate-monotonic, ties by id: the order of core_scheduler.h.
bool higher_priority(const Vcpu& a, const Vcpu& b) {
    return std::tie(a.period, a.id) < std::tie(b.period, b.id);
}

}  // namespace

CompletionTime::CompletionTime(const CoreLoad& load)
    : loops_(load.mains),
      ios_(load.ios),
      overheads_(load.overheads),
      overhead_(load.overheads.per_activation()) {
    std::sort(loops_.begin(), loops_.end(), higher_priority);
    for (std::size_t i = 0; i < loops_.size(); ++i) {
        if (client_periods_.empty() || client_periods_.back() != period(i))
            client_periods_.push_back(period(i));
        client_count_[i] = client_periods_.size();
    }
    for (std::size_t k = 0; k < ios_.size(); ++k) {
        const Vcpu& io = ios_[k];
        for (std::size_t q = 0; q < client_periods_.size(); ++q) {
            io_budgets_[k][q] =
                Nanoseconds{mul_div_ceil(io.budget.count(), client_periods_[q].count(), io.period.count())};
        }
    }
}

std::int64_t CompletionTime::releases(std::size_t j, Nanoseconds window) const {
    return div_ceil(window.count(), period(j).count());
}

Nanoseconds CompletionTime::total(const IoDemand& demand) const {
    return demand.services * (demand.budget + overhead_);
}

CompletionTime::IoDemand CompletionTime::worst_io_demand(std::size_t k, std::size_t i,
                                                         Nanoseconds window) const {
    IoDemand worst;
    for (std::size_t q = 0; q < client_count_[i]; ++q) {
        const Nanoseconds budget = io_budgets_[k][q];
        const Nanoseconds rest = std::max(window - budget, Nanoseconds{0});
        const IoDemand demand{1 + div_ceil(rest.count(), client_periods_[q].count()), budget};
        if (total(demand) > total(worst)) worst = demand;
    }
    return worst;
}

Nanoseconds CompletionTime::demand(std::size_t i, Nanoseconds window) const {
    Nanoseconds sum = cost(i) + overheads_.interference(window);
    for (std::size_t j = 0; j < i; ++j) sum += releases(j, window) * cost(j);
    for (std::size_t k = 0; k < ios_.size(); ++k) sum += total(worst_io_demand(k, i, window));
    return sum;
}

/// C/(1 − U_hp) rounded down; absent when U_hp >= 1: then there is no R.
std::optional<Nanoseconds> CompletionTime::least_response(std::size_t i) const {
    constexpr std::int64_t kOne = std::int64_t{1} << 56;
    // U_hp in units of 2^-56, rounded down, so that the result stays below R.
    std::int64_t taken = 0;
    const auto take = [&](Nanoseconds budget, Nanoseconds each_period) {
        taken += budget >= each_period ? kOne : mul_div_floor(budget.count(), kOne, each_period.count());
    };
    for (std::size_t j = 0; j < i; ++j) take(cost(j), period(j));
    for (const Vcpu& io : ios_) take(io.budget, io.period);
    if (taken >= kOne) return std::nullopt;
    const Int128 least = Int128{cost(i).count()} * kOne / (kOne - taken);
    return Nanoseconds{
        static_cast<std::int64_t>(std::min<Int128>(least, kResponseLimit * kPeriodMax.count() + 1))};
}

Nanoseconds CompletionTime::response(std::size_t i, Nanoseconds limit) const {
    const std::optional<Nanoseconds> start = least_response(i);
    if (!start) return limit + Nanoseconds{1};
    Nanoseconds response = *start;
    while (response <= limit) {
        const Nanoseconds next = demand(i, response);
        if (next <= response) break;
        response = next;
    }
    return response;
}

LoopResponse CompletionTime::verdict(std::size_t i) const {
    return {loop(i).id, response(i, kResponseLimit * period(i)), period(i)};
}

bool CompletionTime::every_loop_meets() const {
    for (std::size_t i = 0; i < loops_.size(); ++i) {
        if (response(i, period(i)) > period(i)) return false;
    }
    return true;
}

Shares CompletionTime::shares(std::size_t i, Nanoseconds window) const {
    Shares shares;
    const auto push = [&](Share::Kind kind, VcpuId id, Nanoseconds amount, const FixedString<23>& name = {}) {
        if (amount > Nanoseconds{0}) shares.push_back({kind, id, name, amount});
    };
    std::int64_t activations = 1;
    push(Share::Kind::own, loops_[i].id, loops_[i].budget);
    for (std::size_t j = 0; j < i; ++j) {
        activations += releases(j, window);
        push(Share::Kind::main, loops_[j].id, releases(j, window) * loops_[j].budget);
    }
    for (std::size_t k = 0; k < ios_.size(); ++k) {
        const IoDemand worst = worst_io_demand(k, i, window);
        activations += worst.services;
        push(Share::Kind::io, ios_[k].id, worst.services * worst.budget);
    }
    for (const PlatformInterferer& interferer : overheads_.interferers) {
        push(Share::Kind::platform, 0, interferer.interference(window), interferer.name);
    }
    push(Share::Kind::overhead, 0, activations * overhead_);
    return shares;
}

}  // namespace qduino::sched
