#include "sched/completion_time.h"

#include <algorithm>

#include "base/contract.h"
#include "sched/exact.h"

namespace qduino::sched {
namespace {

/// The part of a core that is taken, in units of 2^-56.
class Taken {
  public:
    static constexpr std::int64_t kOne = std::int64_t{1} << 56;
    static std::int64_t part(Nanoseconds budget, Nanoseconds period, bool up) {
        const auto rounded = up ? &mul_div_ceil : &mul_div_floor;
        return budget >= period ? kOne : rounded(budget.count(), kOne, period.count());
    }
    void add(Nanoseconds budget, Nanoseconds period, bool up) { sum_ += part(budget, period, up); }
    void add_part(std::int64_t part) { sum_ += part; }
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

/// More than rounding of a few operations can take away.
constexpr double kUp = 1 + 1e-9;

}  // namespace

Nanoseconds service_of(const Vcpu& io, Nanoseconds period, Nanoseconds overhead) {
    const Nanoseconds share{mul_div_ceil(io.budget.count(), period.count(), io.period.count())};
    return std::max(share, overhead + Nanoseconds{1});
}

CompletionTime::CompletionTime(const CoreLoad& load)
    : loops_(load.mains),
      ios_(load.ios),
      overheads_(load.all_overheads()),
      overhead_(load.overheads.per_activation()),
      priorities_(load.overheads.priorities) {
    std::sort(loops_.begin(), loops_.end(), ranks_above);
    for (std::size_t i = 0; i < loops_.size(); ++i) {
        periods_[i] = Divisor{period(i)};
        if (client_periods_.empty() || client_periods_.back().period() != period(i))
            client_periods_.push_back(periods_[i]);
        client_count_[i] = client_periods_.size();
    }
    hold_up(load);
    for (std::size_t i = 0; i < loops_.size(); ++i) share_[i] = Taken::part(cost(i), period(i), false);
    for (std::size_t k = 0; k < ios_.size(); ++k) prepare(ios_[k], io_[k]);
    keep_for_others();
}

void CompletionTime::prepare(const Vcpu& vcpu, Io& io) const {
    if (vcpu.client_period > Nanoseconds{0}) io.named_client = Divisor{vcpu.client_period};
    io.share = Taken::part(vcpu.budget, vcpu.period, false);
    const auto clients = clients_of(static_cast<std::size_t>(&vcpu - ios_.begin()), loops_.size());
    for (std::size_t q = 0; q < clients.size(); ++q) {
        io.budgets[q] = service_of(vcpu, clients[q].period(), overhead_);
        const double per_time =
            static_cast<double>(io.budgets[q].count()) / static_cast<double>(clients[q].period().count());
        io.most_per_time = std::max(io.most_per_time, per_time * kUp);
    }
}

/// Ordinary tasks get what is kept for them without anybody's doing, as long as the loops leave it.
/// Otherwise it is taken from the loops, in one piece, and two pieces can meet: one at the end of a
/// period, one at the begin of the next.
void CompletionTime::keep_for_others() {
    const PlatformInterferer kept = overheads_.kept();
    if (kept.cost <= Nanoseconds{0} || loops_.empty()) return;
    const Nanoseconds taken = taken_by_others(loops_.size(), loops_.size() - 1, kept.interval, nullptr);
    keeps_for_others_ = taken + kept.cost > kept.interval;
    if (keeps_for_others_) overheads_.interferers.push_back(kept);
}

void CompletionTime::hold_up(const CoreLoad& load) {
    FixedVector<VcpuId, kMainVcpuLimit> by_rank;
    for (const Vcpu& loop : loops_) by_rank.push_back(loop.id);
    // Locks that are shared with other cores are counted in `waits`.
    CriticalSections local;
    for (const CriticalSection& section : load.sections) {
        if (section.assumed || load.waits_of(section.loop).requests == 0) local.push_back(section);
    }
    FixedVector<VcpuId, kIoVcpuLimit> handlers;
    for (const Vcpu& io : ios_) handlers.push_back(io.id);
    std::optional<Blocking> blocking;
    if (!local.empty()) blocking.emplace(by_rank, local, handlers);
    for (std::size_t i = 0; i < loops_.size(); ++i) {
        const Vcpu& loop = loops_[i];
        waits_[i] = load.waits_of(loop.id);
        activation_[i] = overheads_.per_release(loop, requests_of(load.sections, loop.id));
        allowance_[i] = load.allowance_of(loop);
        late_[i] = (1 + loop.times_asleep()) * overheads_.wake_latency;
        const int begins = 1 + loop.times_asleep() + waits_[i].requests;
        held_up_[i] = loop.suspension + waits_[i].requests * waits_[i].each +
                      std::min(begins, 2) * waits_[i].lifted + late_[i];
        if (blocking) {
            blocked_[i] = blocking->of(i);
            held_up_[i] += begins * blocked_[i];
            by_handlers_[i] = blocking->by_handlers(i);
        }
    }
    for (std::size_t k = 0; blocking && k < ios_.size(); ++k)
        io_held_up_[k] = blocking->of_handler(ios_[k].id);
}

bool CompletionTime::shares_priority(std::size_t i) const { return i + 1 >= priorities_; }

std::size_t CompletionTime::delaying(std::size_t i) const { return shares_priority(i) ? loops_.size() : i; }

std::span<const Divisor> CompletionTime::clients_of(std::size_t k, std::size_t i) const {
    const bool any_loop = i == loops_.size() || shares_priority(i);
    if (ios_[k].client_period > Nanoseconds{0}) {
        const bool is_hep = any_loop || ios_[k].client_period <= period(i);
        return {&io_[k].named_client, is_hep ? std::size_t{1} : std::size_t{0}};
    }
    return {client_periods_.begin(), any_loop ? client_periods_.size() : client_count_[i]};
}

Nanoseconds CompletionTime::jitter(std::size_t j) const {
    return loops_[j].deferrable || waits_[j].requests > 0
               ? period(j) - loops_[j].budget
               : std::min(overheads_.wake_latency, period(j) - loops_[j].budget);
}

/// From the longest client down. A client takes at most two services and its share of the window;
/// budgets fall with the periods, so the first one that cannot reach the worst ends the search.
CompletionTime::IoDemand CompletionTime::worst_io_demand(std::size_t k, std::size_t i,
                                                         Nanoseconds window) const {
    IoDemand worst;
    Nanoseconds most{};
    const Io& io = io_[k];
    const auto clients = clients_of(k, i);
    const Nanoseconds by_share{
        static_cast<std::int64_t>(static_cast<double>(window.count()) * io.most_per_time * kUp) + 1};
    for (std::size_t q = clients.size(); q-- > 0;) {
        const Nanoseconds budget = io.budgets[q];
        if (2 * budget + by_share <= most) break;
        const Nanoseconds rest = std::max(window - budget, Nanoseconds{0});
        const std::int64_t services = 1 + clients[q].ceil(rest);
        if (services * budget <= most) continue;
        most = services * budget;
        worst = {services, budget};
    }
    return worst;
}

Nanoseconds CompletionTime::taken_by_others(std::size_t count, std::size_t i, Nanoseconds window,
                                            const Vcpu* itself) const {
    Nanoseconds sum = overheads_.interference(window);
    for (std::size_t j = 0; j < count; ++j) {
        if (&loops_[j] != itself) sum += releases(j, window) * cost(j);
    }
    for (std::size_t k = 0; k < ios_.size(); ++k) {
        if (&ios_[k] == itself) continue;
        const IoDemand worst = worst_io_demand(k, i, window);
        sum += worst.services * worst.budget;
    }
    return sum;
}

Nanoseconds CompletionTime::demand(std::size_t i, Nanoseconds window) const {
    return own_cost(i) + held_up_[i] + taken_by_others(delaying(i), i, window, &loops_[i]);
}

/// `fixed`/(1 − U) rounded down, with U of what taken_by_others() has but the platform; absent when
/// U >= 1: then there is no R.
std::optional<Nanoseconds> CompletionTime::least_response(std::size_t count, std::size_t i, Nanoseconds fixed,
                                                          const Vcpu* itself) const {
    Taken taken;
    for (std::size_t j = 0; j < count; ++j) {
        if (&loops_[j] != itself) taken.add_part(share_[j]);
    }
    for (std::size_t k = 0; k < ios_.size(); ++k) {
        if (&ios_[k] != itself && !clients_of(k, i).empty()) taken.add_part(io_[k].share);
    }
    if (taken.whole()) return std::nullopt;
    return taken.stretch(fixed);
}

/// The equation with x + 1 for each ⌈x⌉, solved: R is at most this. Absent when there is no
/// solution.
std::optional<Nanoseconds> CompletionTime::most_response(std::size_t i) const {
    Taken taken;
    Nanoseconds fixed = own_cost(i) + held_up_[i];
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
            of_client.add(io_[k].budgets[q], clients[q].period(), true);
            greatest = std::max(greatest, of_client);
            most = std::max(most, io_[k].budgets[q]);
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

CompletionTime::Solution CompletionTime::solve(std::size_t i, Nanoseconds limit, Nanoseconds at_least,
                                               Wanted wanted) const {
    const std::optional<Nanoseconds> start =
        least_response(delaying(i), i, own_cost(i) + held_up_[i], &loops_[i]);
    if (!start) return {limit + Nanoseconds{1}, {}};
    Nanoseconds response = std::max(*start, at_least);
    for (int step = 0; response <= limit; ++step) {
        const Nanoseconds next = demand(i, response);
        if (next <= response) break;
        if (step == kSteps || (step == kStepsToAsk && wanted == Wanted::whether)) {
            const Nanoseconds most = most_response(i).value_or(limit + Nanoseconds{1});
            if (step == kSteps || most <= limit) return {most, response};
        }
        response = next;
    }
    return {response, response};
}

Nanoseconds CompletionTime::next_at_least(std::size_t i, Nanoseconds at_least) const {
    const std::size_t next = i + 1;
    if (next >= loops_.size() || shares_priority(i)) return Nanoseconds{0};
    const Nanoseconds more = own_cost(next) + held_up_[next] - held_up_[i];
    return more >= Nanoseconds{0} ? at_least + more : Nanoseconds{0};
}

Nanoseconds CompletionTime::response(std::size_t i, Nanoseconds limit) const {
    return solve(i, limit, Nanoseconds{0}, Wanted::response).response;
}

FixedVector<LoopResponse, kMainVcpuLimit> CompletionTime::verdicts() const {
    FixedVector<LoopResponse, kMainVcpuLimit> found;
    Nanoseconds at_least{};
    for (std::size_t i = 0; i < loops_.size(); ++i) {
        const Solution solution = solve(i, kResponseLimit * period(i), at_least, Wanted::response);
        found.push_back({loop(i).id, solution.response, period(i)});
        at_least = next_at_least(i, solution.at_least);
    }
    return found;
}

IoResponse CompletionTime::io_verdict(std::size_t k) const {
    QDUINO_EXPECT(!loops_.empty());
    const Nanoseconds client =
        ios_[k].client_period > Nanoseconds{0} ? ios_[k].client_period : client_periods_.front().period();
    // A loop of the client's period goes first: its number is lower.
    std::size_t above = 0;
    while (above < loops_.size() && period(above) <= client) ++above;
    const Nanoseconds own = service_of(ios_[k], client, overhead_) + io_held_up_[k];
    const std::size_t lowest = std::max<std::size_t>(above, 1) - 1;
    const auto demand_in = [&](Nanoseconds window) {
        return own + taken_by_others(above, lowest, window, &ios_[k]);
    };
    const Nanoseconds limit = kResponseLimit * client;
    Nanoseconds response = least_response(above, lowest, own, &ios_[k]).value_or(limit + Nanoseconds{1});
    for (int step = 0; response <= limit; ++step) {
        const Nanoseconds next = step < kSteps ? demand_in(response) : limit + Nanoseconds{1};
        if (next <= response) break;
        response = next;
    }
    return {ios_[k].id, response, client};
}

bool CompletionTime::blocks_after_each_sleep(VcpuId id) const {
    for (std::size_t i = 0; i < loops_.size(); ++i) {
        if (loops_[i].id == id)
            return blocked_[i] + waits_[i].lifted + overheads_.wake_latency > Nanoseconds{0};
    }
    return false;
}

bool CompletionTime::every_loop_meets() const {
    Nanoseconds at_least{};
    for (std::size_t i = 0; i < loops_.size(); ++i) {
        const Solution solution = solve(i, period(i), at_least, Wanted::whether);
        if (solution.response > period(i)) return false;
        at_least = next_at_least(i, solution.at_least);
    }
    return true;
}

/// R <= T where some window up to T has more time than is asked for. The gap is widest just before
/// something is asked for: looked at are the last such windows, and T.
Nanoseconds CompletionTime::room(std::size_t i) const {
    const auto gap = [&](Nanoseconds window) { return window - demand(i, window); };
    Nanoseconds room = std::max(gap(period(i)), Nanoseconds{0});
    for (std::size_t j = 0; j < delaying(i); ++j) {
        const std::int64_t before = (period(i) + jitter(j)).count() / period(j).count();
        const Nanoseconds window = before * period(j) - jitter(j);
        if (window > Nanoseconds{0}) room = std::max(room, gap(window));
    }
    return room;
}

Shares CompletionTime::shares(std::size_t i, Nanoseconds window) const {
    Shares shares;
    const auto push = [&](Share::Kind kind, VcpuId id, Nanoseconds amount, const FixedString<23>& name = {}) {
        if (amount > Nanoseconds{0}) shares.push_back({kind, id, name, amount});
    };
    Nanoseconds overhead = activation_[i];
    const Nanoseconds remote = waits_[i].requests * waits_[i].each;
    push(Share::Kind::own, loops_[i].id, loops_[i].budget);
    push(Share::Kind::sleep, loops_[i].id, loops_[i].suspension);
    push(Share::Kind::blocking, loops_[i].id,
         held_up_[i] - loops_[i].suspension - remote - late_[i] + by_handlers_[i]);
    push(Share::Kind::platform, 0, late_[i], FixedString<23>{"late wake-ups"});
    push(Share::Kind::remote, loops_[i].id, remote);
    for (std::size_t j = 0; j < delaying(i); ++j) {
        if (j == i) continue;
        overhead += releases(j, window) * (activation_[j] + by_handlers_[j] + allowance_[j]);
        push(Share::Kind::main, loops_[j].id, releases(j, window) * loops_[j].budget);
    }
    for (std::size_t k = 0; k < ios_.size(); ++k) {
        const IoDemand worst = worst_io_demand(k, i, window);
        push(Share::Kind::io, ios_[k].id, worst.services * worst.budget);
    }
    for (const PlatformInterferer& interferer : overheads_.interferers) {
        push(Share::Kind::platform, 0, interferer.interference(window), interferer.name);
    }
    push(Share::Kind::overhead, 0, overhead);
    return shares;
}

}  // namespace qduino::sched
