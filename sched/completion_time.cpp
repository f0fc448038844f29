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

/// The part of a core that is taken, in units of 2^-56.
class Taken {
  public:
    static constexpr std::int64_t kOne = std::int64_t{1} << 56;
    void add(Nanoseconds budget, Nanoseconds period, bool up) {
        const auto part = up ? &mul_div_ceil : &mul_div_floor;
        sum_ += budget >= period ? kOne : part(budget.count(), kOne, period.count());
    }
    void add(const Taken& other) { sum_ += other.sum_; }
    bool operator<(const Taken& other) const { return sum_ < other.sum_; }
    [[nodiscard]] bool whole() const { return sum_ >= kOne; }
    /// time/(1 − taken), rounded down; some value beyond what is ever followed where it is more.
    [[nodiscard]] Nanoseconds stretch(Nanoseconds time) const {
        const Int128 longer = Int128{time.count()} * kOne / (kOne - sum_);
        return Nanoseconds{
            static_cast<std::int64_t>(std::min<Int128>(longer, kResponseLimit * kPeriodMax.count() + 1))};
    }

  private:
    std::int64_t sum_ = 0;
};

}  // namespace

CompletionTime::CompletionTime(const CoreLoad& load)
    : loops_(load.mains),
      ios_(load.ios),
      overheads_(load.overheads),
      overhead_(load.overheads.per_activation()),
      priorities_(load.overheads.priorities) {
    std::sort(loops_.begin(), loops_.end(), higher_priority);
    for (std::size_t i = 0; i < loops_.size(); ++i) {
        if (client_periods_.empty() || client_periods_.back() != period(i))
            client_periods_.push_back(period(i));
        client_count_[i] = client_periods_.size();
    }
    for (std::size_t k = 0; k < ios_.size(); ++k) {
        const Vcpu& io = ios_[k];
        const auto clients = clients_of(k, loops_.size());
        for (std::size_t q = 0; q < clients.size(); ++q) {
            const Nanoseconds share{mul_div_ceil(io.budget.count(), clients[q].count(), io.period.count())};
            io_budgets_[k][q] = std::max(share, overhead_ + Nanoseconds{1});
        }
    }
    hold_up(load.sections);
    keep_for_others();
}

/// Ordinary tasks get what is kept for them without anybody's doing, as long as the loops leave it.
/// Otherwise it is taken from the loops, in one piece, and two pieces can meet: one at the end of a
/// period, one at the begin of the next.
void CompletionTime::keep_for_others() {
    const Nanoseconds window = overheads_.kept_period, kept = overheads_.kept_budget;
    if (kept <= Nanoseconds{0} || loops_.empty()) return;
    Nanoseconds taken = overheads_.interference(window);
    for (std::size_t j = 0; j < loops_.size(); ++j) taken += releases(j, window) * cost(j);
    for (std::size_t k = 0; k < ios_.size(); ++k) {
        const IoDemand worst = worst_io_demand(k, loops_.size() - 1, window);
        taken += worst.services * worst.budget;
    }
    if (taken + kept > window && !overheads_.interferers.full())
        overheads_.interferers.push_back({"what the kernel keeps", kept, window, window - kept});
}

void CompletionTime::hold_up(const CriticalSections& sections) {
    FixedVector<VcpuId, kMainVcpuLimit> by_rank;
    for (const Vcpu& loop : loops_) by_rank.push_back(loop.id);
    std::optional<Blocking> blocking;
    if (!sections.empty()) blocking.emplace(by_rank, sections);
    for (std::size_t i = 0; i < loops_.size(); ++i) {
        held_up_[i] = loops_[i].suspension;
        if (blocking)
            held_up_[i] +=
                blocking->of(i) * (1 + (loops_[i].suspension > Nanoseconds{0} ? loops_[i].sleeps : 0));
    }
}

bool CompletionTime::shares_priority(std::size_t i) const { return i + 1 >= priorities_; }

std::size_t CompletionTime::delaying(std::size_t i) const { return shares_priority(i) ? loops_.size() : i; }

std::span<const Nanoseconds> CompletionTime::clients_of(std::size_t k, std::size_t i) const {
    const bool any_loop = i == loops_.size() || shares_priority(i);
    if (const Nanoseconds& one = ios_[k].client_period; one > Nanoseconds{0})
        return {&one, any_loop || one <= period(i) ? std::size_t{1} : std::size_t{0}};
    return {client_periods_.begin(), any_loop ? client_periods_.size() : client_count_[i]};
}

Nanoseconds CompletionTime::jitter(std::size_t j) const {
    return loops_[j].deferrable ? period(j) - loops_[j].budget : Nanoseconds{0};
}

std::int64_t CompletionTime::releases(std::size_t j, Nanoseconds window) const {
    return div_ceil((window + jitter(j)).count(), period(j).count());
}

CompletionTime::IoDemand CompletionTime::worst_io_demand(std::size_t k, std::size_t i,
                                                         Nanoseconds window) const {
    IoDemand worst;
    const auto clients = clients_of(k, i);
    for (std::size_t q = 0; q < clients.size(); ++q) {
        const Nanoseconds budget = io_budgets_[k][q];
        const Nanoseconds rest = std::max(window - budget, Nanoseconds{0});
        const IoDemand demand{1 + div_ceil(rest.count(), clients[q].count()), budget};
        if (demand.services * demand.budget > worst.services * worst.budget) worst = demand;
    }
    return worst;
}

Nanoseconds CompletionTime::demand(std::size_t i, Nanoseconds window) const {
    Nanoseconds sum = cost(i) + held_up_[i] + overheads_.interference(window);
    for (std::size_t j = 0; j < delaying(i); ++j) {
        if (j != i) sum += releases(j, window) * cost(j);
    }
    for (std::size_t k = 0; k < ios_.size(); ++k) {
        const IoDemand worst = worst_io_demand(k, i, window);
        sum += worst.services * worst.budget;
    }
    return sum;
}

/// (C + S + B)/(1 − U_hp) rounded down; absent when U_hp >= 1: then there is no R.
std::optional<Nanoseconds> CompletionTime::least_response(std::size_t i) const {
    Taken taken;
    for (std::size_t j = 0; j < delaying(i); ++j) {
        if (j != i) taken.add(cost(j), period(j), false);
    }
    for (std::size_t k = 0; k < ios_.size(); ++k) {
        if (!clients_of(k, i).empty()) taken.add(ios_[k].budget, ios_[k].period, false);
    }
    if (taken.whole()) return std::nullopt;
    return taken.stretch(cost(i) + held_up_[i]);
}

/// The equation with x + 1 for each ⌈x⌉, solved: R is at most this. Absent when there is no
/// solution.
std::optional<Nanoseconds> CompletionTime::most_response(std::size_t i) const {
    Taken taken;
    Nanoseconds fixed = cost(i) + held_up_[i];
    const auto take = [&](Nanoseconds budget, Nanoseconds each_period, Nanoseconds early) {
        taken.add(budget, each_period, true);
        fixed += budget + Nanoseconds{mul_div_ceil(early.count(), budget.count(), each_period.count())};
    };
    for (std::size_t j = 0; j < delaying(i); ++j) {
        if (j != i) take(cost(j), period(j), jitter(j));
    }
    for (std::size_t k = 0; k < ios_.size(); ++k) {
        // Of any client: the greatest share of time, and the greatest budget twice.
        Nanoseconds most{};
        Taken greatest;
        const auto clients = clients_of(k, i);
        for (std::size_t q = 0; q < clients.size(); ++q) {
            Taken of_client;
            of_client.add(io_budgets_[k][q], clients[q], true);
            greatest = std::max(greatest, of_client);
            most = std::max(most, io_budgets_[k][q]);
        }
        taken.add(greatest);
        fixed += 2 * most;
    }
    for (const PlatformInterferer& interferer : overheads_.interferers) {
        if (interferer.cost > Nanoseconds{0}) take(interferer.cost, interferer.interval, interferer.jitter);
    }
    if (taken.whole()) return std::nullopt;
    return taken.stretch(fixed) + Nanoseconds{1};
}

Nanoseconds CompletionTime::response(std::size_t i, Nanoseconds limit) const {
    const std::optional<Nanoseconds> start = least_response(i);
    if (!start) return limit + Nanoseconds{1};
    Nanoseconds response = *start;
    for (int step = 0; response <= limit; ++step) {
        const Nanoseconds next = demand(i, response);
        if (next <= response) break;
        if (step == kSteps) return most_response(i).value_or(limit + Nanoseconds{1});
        response = next;
    }
    return response;
}

LoopResponse CompletionTime::verdict(std::size_t i) const {
    return {loop(i).id, response(i, kResponseLimit * period(i)), period(i)};
}

IoResponse CompletionTime::io_verdict(std::size_t k) const {
    QDUINO_EXPECT(!loops_.empty());
    const Nanoseconds client =
        ios_[k].client_period > Nanoseconds{0} ? ios_[k].client_period : client_periods_.front();
    // A loop of the client's period goes first: its number is lower.
    std::size_t above = 0;
    while (above < loops_.size() && period(above) <= client) ++above;
    const Nanoseconds share{mul_div_ceil(ios_[k].budget.count(), client.count(), ios_[k].period.count())};
    const Nanoseconds own = std::max(share, overhead_ + Nanoseconds{1});
    const auto demand_in = [&](Nanoseconds window) {
        Nanoseconds sum = own + overheads_.interference(window);
        for (std::size_t j = 0; j < above; ++j) sum += releases(j, window) * cost(j);
        for (std::size_t other = 0; other < ios_.size(); ++other) {
            if (other == k) continue;
            const IoDemand worst = worst_io_demand(other, std::max<std::size_t>(above, 1) - 1, window);
            sum += worst.services * worst.budget;
        }
        return sum;
    };
    Nanoseconds response = own;
    const Nanoseconds limit = kResponseLimit * client;
    for (int step = 0; response <= limit; ++step) {
        const Nanoseconds next = step < kSteps ? demand_in(response) : limit + Nanoseconds{1};
        if (next <= response) break;
        response = next;
    }
    return {ios_[k].id, response, client};
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
    push(Share::Kind::sleep, loops_[i].id, loops_[i].suspension);
    push(Share::Kind::blocking, loops_[i].id, held_up_[i] - loops_[i].suspension);
    for (std::size_t j = 0; j < delaying(i); ++j) {
        if (j == i) continue;
        activations += releases(j, window);
        push(Share::Kind::main, loops_[j].id, releases(j, window) * loops_[j].budget);
    }
    for (std::size_t k = 0; k < ios_.size(); ++k) {
        const IoDemand worst = worst_io_demand(k, i, window);
        push(Share::Kind::io, ios_[k].id, worst.services * worst.budget);
    }
    for (const PlatformInterferer& interferer : overheads_.interferers) {
        push(Share::Kind::platform, 0, interferer.interference(window), interferer.name);
    }
    push(Share::Kind::overhead, 0, activations * overhead_);
    return shares;
}

}  // namespace qduino::sched
