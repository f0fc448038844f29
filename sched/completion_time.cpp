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

Nanoseconds service_of(const Vcpu& io, Nanoseconds period, Nanoseconds overhead) {
    const Nanoseconds share{mul_div_ceil(io.budget.count(), period.count(), io.period.count())};
    return std::max(share, overhead + Nanoseconds{1});
}

Nanoseconds longest_service_of(const Vcpu& io, Nanoseconds period, Nanoseconds overhead) {
    const Nanoseconds share{mul_div_floor(io.budget.count(), period.count(), io.period.count())};
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
        if (client_periods_.empty() || client_periods_.back() != period(i))
            client_periods_.push_back(period(i));
    }
    loops_go_first_ =
        load.sections.empty() && load.waits.empty() && loops_.size() + ios_.size() <= priorities_;
    hold_up(load);
    for (std::size_t i = 0; i < loops_.size(); ++i) share_[i] = Taken::part(cost(i), period(i), false);
    for (std::size_t k = 0; k < ios_.size(); ++k)
        io_[k] = {Rate{ios_[k].budget, ios_[k].period}, Taken::part(ios_[k].budget, ios_[k].period, false)};
    keep_for_others();
}

/// Ordinary tasks get what is kept for them without anybody's doing, as long as the loops leave it.
/// Otherwise it is taken from the loops, in one piece, and two pieces can meet: one at the end of a
/// period, one at the begin of the next.
void CompletionTime::keep_for_others() {
    const PlatformInterferer kept = overheads_.kept();
    if (kept.cost <= Nanoseconds{0} || loops_.empty()) return;
    // This window may begin anywhere: behind a service's begin, by its client's period at most.
    Level all = level_of_service(kNone, kPeriodMax);
    for (const Nanoseconds service : all.services) all.own += service;
    const Nanoseconds taken = demand(all, kept.interval);
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

/// The bottom halves may all rank above it.
bool CompletionTime::shares_priority(std::size_t i) const {
    return loops_.size() + ios_.size() > priorities_ && i + 1 + ios_.size() >= priorities_;
}

std::size_t CompletionTime::delaying(std::size_t i) const { return shares_priority(i) ? loops_.size() : i; }

void CompletionTime::add_services(Level& level, Nanoseconds longest, std::size_t itself) const {
    const auto beyond = std::ranges::upper_bound(client_periods_, longest);
    for (std::size_t k = 0; k < ios_.size(); ++k) {
        const Nanoseconds named = ios_[k].client_period;
        const bool none = named > Nanoseconds{0} ? named > longest : beyond == client_periods_.begin();
        if (k == itself || none) continue;
        level.services[k] =
            longest_service_of(ios_[k], named > Nanoseconds{0} ? named : *std::prev(beyond), overhead_);
        ++level.io_count;
    }
}

CompletionTime::Level CompletionTime::level_of(std::size_t i) const {
    Level level{.own = own_cost(i) + held_up_[i], .loops = delaying(i), .itself = i};
    const Nanoseconds longest = loops_go_first_ ? period(i) - Nanoseconds{1} : period(i);
    add_services(level, shares_priority(i) ? kPeriodMax : longest, kNone);
    return level;
}

/// Loops of the client's period go first: their numbers are lower.
CompletionTime::Level CompletionTime::level_of_service(std::size_t k, Nanoseconds client) const {
    Level level;
    while (level.loops < loops_.size() && period(level.loops) <= client) ++level.loops;
    const bool shares = loops_.size() + ios_.size() > priorities_ && level.loops + ios_.size() >= priorities_;
    if (shares) level.loops = loops_.size();
    if (k != kNone) level.own = longest_service_of(ios_[k], client, overhead_) + io_held_up_[k];
    add_services(level, shares ? kPeriodMax : client, k);
    return level;
}

Nanoseconds CompletionTime::jitter(std::size_t j) const {
    return loops_[j].deferrable || waits_[j].requests > 0
               ? period(j) - loops_[j].budget
               : std::min(overheads_.wake_latency, period(j) - loops_[j].budget);
}

Nanoseconds CompletionTime::demand(const Level& level, Nanoseconds window) const {
    Nanoseconds sum = level.own + overheads_.interference(window);
    for (std::size_t j = 0; j < level.loops; ++j) {
        if (j != level.itself) sum += releases(j, window) * cost(j);
    }
    for (std::size_t k = 0; k < ios_.size(); ++k) {
        if (level.services[k] > Nanoseconds{0}) sum += io_demand(level, k, window);
    }
    return sum;
}

/// The equation with x for each ⌈x⌉, and without the platform, solved: R is not below it. Absent
/// where there is no solution.
std::optional<Nanoseconds> CompletionTime::least_response(const Level& level) const {
    Taken taken;
    Nanoseconds fixed = level.own;
    for (std::size_t j = 0; j < level.loops; ++j) {
        if (j != level.itself) taken.add_part(share_[j]);
    }
    for (std::size_t k = 0; k < ios_.size(); ++k) {
        const Nanoseconds longest = level.services[k];
        if (longest == Nanoseconds{0}) continue;
        taken.add_part(io_[k].share);
        fixed += longest - io_[k].rate.ceil(longest);
    }
    if (taken.whole()) return std::nullopt;
    return taken.stretch(fixed);
}

/// The equation with x + 1 for each ⌈x⌉, solved: R is at most this. Absent when there is no
/// solution.
std::optional<Nanoseconds> CompletionTime::most_response(const Level& level) const {
    Taken taken;
    Nanoseconds fixed = level.own;
    const auto take = [&](Nanoseconds budget, Nanoseconds each_period, Nanoseconds early) {
        taken.add(budget, each_period, true);
        fixed += budget + Nanoseconds{mul_div_ceil(early.count(), budget.count(), each_period.count())};
    };
    for (std::size_t j = 0; j < level.loops; ++j) {
        if (j != level.itself) take(cost(j), period(j), jitter(j));
    }
    for (std::size_t k = 0; k < ios_.size(); ++k) {
        if (level.services[k] == Nanoseconds{0}) continue;
        taken.add(ios_[k].budget, ios_[k].period, true);
        fixed += level.services[k] + Nanoseconds{1};
    }
    for (const PlatformInterferer& interferer : overheads_.interferers) {
        if (interferer.cost > Nanoseconds{0}) take(interferer.cost, interferer.interval, interferer.jitter);
    }
    if (taken.whole()) return std::nullopt;
    return taken.stretch(fixed) + Nanoseconds{1};
}

/// What bottom halves take grows with the window, in ever smaller steps; of these, all are taken at
/// once: R − w is at least (demand(w) − w)/(1 − U), but for what is rounded up.
CompletionTime::Solution CompletionTime::solve(const Level& level, Nanoseconds limit, Nanoseconds at_least,
                                               Wanted wanted) const {
    const std::optional<Nanoseconds> start = least_response(level);
    if (!start) return {limit + Nanoseconds{1}, {}};
    Taken of_services;
    for (std::size_t k = 0; k < ios_.size(); ++k) {
        if (level.services[k] > Nanoseconds{0}) of_services.add_part(io_[k].share);
    }
    const Nanoseconds rounded{static_cast<std::int64_t>(level.io_count)};
    Nanoseconds response = std::max(*start, at_least);
    for (int step = 0; response <= limit; ++step) {
        const Nanoseconds more = demand(level, response) - response;
        if (more <= Nanoseconds{0}) break;
        if (step == kSteps || (step == kStepsToAsk && wanted == Wanted::whether)) {
            const Nanoseconds most = most_response(level).value_or(limit + Nanoseconds{1});
            if (step == kSteps || most <= limit) return {most, response};
        }
        response += std::max(more, more > rounded ? of_services.stretch(more - rounded) : Nanoseconds{0});
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
    return solve(level_of(i), limit, Nanoseconds{0}, Wanted::response).response;
}

FixedVector<LoopResponse, kMainVcpuLimit> CompletionTime::verdicts() const {
    FixedVector<LoopResponse, kMainVcpuLimit> found;
    Nanoseconds at_least{};
    for (std::size_t i = 0; i < loops_.size(); ++i) {
        const Solution solution = solve(level_of(i), kResponseLimit * period(i), at_least, Wanted::response);
        found.push_back({loop(i).id, solution.response, period(i)});
        at_least = next_at_least(i, solution.at_least);
    }
    return found;
}

IoResponse CompletionTime::io_verdict(std::size_t k) const {
    QDUINO_EXPECT(!loops_.empty());
    const Nanoseconds client =
        ios_[k].client_period > Nanoseconds{0} ? ios_[k].client_period : client_periods_.front();
    return {ios_[k].id, service_response(k, client), client};
}

Nanoseconds CompletionTime::service_response(std::size_t k, Nanoseconds client) const {
    return solve(level_of_service(k, client), kResponseLimit * client, Nanoseconds{0}, Wanted::response)
        .response;
}

/// Where all services of a client fit in together, each of them does.
std::optional<CompletionTime::LateService> CompletionTime::late_service() const {
    const auto fits = [&](std::size_t k, Nanoseconds client) {
        return solve(level_of_service(k, client), client, Nanoseconds{0}, Wanted::whether).response <= client;
    };
    FixedVector<Nanoseconds, kMainVcpuLimit> tight;
    if (std::ranges::any_of(ios_, [](const Vcpu& io) { return io.client_period == Nanoseconds{0}; })) {
        for (const Nanoseconds client : client_periods_) {
            if (!fits(kNone, client)) tight.push_back(client);
        }
    }
    for (std::size_t k = 0; k < ios_.size(); ++k) {
        const Nanoseconds named = ios_[k].client_period;
        if (named > Nanoseconds{0}) {
            if (!fits(k, named)) return LateService{k, named, service_response(k, named)};
            continue;
        }
        for (const Nanoseconds client : tight) {
            if (!fits(k, client)) return LateService{k, client, service_response(k, client)};
        }
    }
    return std::nullopt;
}

/// As above, with the term that counts each service as a whole one, and two at the least. The
/// lowest loop is asked first: it has the most to bear.
bool CompletionTime::meets_beside_whole_services() const {
    const auto whole_services = [this](std::size_t k, Nanoseconds longest, Nanoseconds window) {
        Nanoseconds most{};
        const auto consider = [&](Nanoseconds client) {
            if (client > longest) return;
            const Nanoseconds service = service_of(ios_[k], client, overhead_);
            const Nanoseconds rest = std::max(window - service, Nanoseconds{0});
            most = std::max(most, (1 + div_ceil(rest.count(), client.count())) * service);
        };
        if (ios_[k].client_period > Nanoseconds{0}) {
            consider(ios_[k].client_period);
        } else {
            std::ranges::for_each(client_periods_, consider);
        }
        return most;
    };
    for (std::size_t i = loops_.size(); i-- > 0;) {
        const Nanoseconds longest = shares_priority(i) ? kPeriodMax : period(i);
        Level level = level_of(i);
        level.services = {};
        Nanoseconds window{}, asked = level.own;
        for (int step = 0; asked > window && asked <= period(i); ++step) {
            if (step == kSteps) return false;
            window = asked;
            asked = demand(level, window);
            for (std::size_t k = 0; k < ios_.size(); ++k) asked += whole_services(k, longest, window);
        }
        if (asked > period(i)) return false;
    }
    return true;
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
        const Solution solution = solve(level_of(i), period(i), at_least, Wanted::whether);
        if (solution.response > period(i)) return false;
        at_least = next_at_least(i, solution.at_least);
    }
    return true;
}

/// R <= T where some window up to T has more time than is asked for. The gap is widest just before
/// something is asked for: looked at are the last such windows, and T.
Nanoseconds CompletionTime::room(std::size_t i) const {
    const Level level = level_of(i);
    const auto gap = [&](Nanoseconds window) { return window - demand(level, window); };
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
    push_services(shares, level_of(i), window);
    push(Share::Kind::overhead, 0, overhead);
    return shares;
}

Shares CompletionTime::io_shares(std::size_t k, Nanoseconds client, Nanoseconds window) const {
    const Level level = level_of_service(k, client);
    Shares shares;
    Nanoseconds overhead{};
    shares.push_back({Share::Kind::io, ios_[k].id, {}, level.own});
    for (std::size_t j = 0; j < level.loops; ++j) {
        overhead += releases(j, window) * (activation_[j] + by_handlers_[j] + allowance_[j]);
        shares.push_back({Share::Kind::main, loops_[j].id, {}, releases(j, window) * loops_[j].budget});
    }
    push_services(shares, level, window);
    if (overhead > Nanoseconds{0}) shares.push_back({Share::Kind::overhead, 0, {}, overhead});
    return shares;
}

/// Bottom halves and the platform.
void CompletionTime::push_services(Shares& shares, const Level& level, Nanoseconds window) const {
    for (std::size_t k = 0; k < ios_.size(); ++k) {
        if (level.services[k] > Nanoseconds{0})
            shares.push_back({Share::Kind::io, ios_[k].id, {}, io_demand(level, k, window)});
    }
    for (const PlatformInterferer& interferer : overheads_.interferers) {
        const Nanoseconds taken = interferer.interference(window);
        if (taken <= Nanoseconds{0}) continue;
        Share share{.kind = Share::Kind::platform, .name = interferer.name, .amount = taken};
        if (interferer.jitter >= interferer.interval) {
            share.at_once = interferer.interference(Nanoseconds{1});
            share.long_run_ppm = interferer.long_run_ppm();
        }
        shares.push_back(share);
    }
}

}  // namespace qduino::sched
