// Every schedule that one small core can have, or two that share locks, one tick at a time.
//
// A simulation tries the phasings that somebody thought of. Here each loop may be released at any
// tick that its period allows, each suspension may be as long as it likes, and each device may ask
// for its bottom half at any tick and for any client. All of it is tried; states that were seen
// before are not followed twice. That is possible for periods up to 10 and three loops.
//
// This model shares no code with sched/. Its servers are lists of single ticks of budget, its
// scheduler looks at everything anew in each tick. What of it a mutant may break is in `Rules`.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <unordered_set>
#include <utility>
#include <vector>

namespace qduino::sched::model {

enum class Do : std::uint8_t { run, lock, unlock, suspend };

/// One step of a loop's body: `run` n ticks, `suspend` for 0 to n ticks, take or give back lock n.
struct Step {
    Do what;
    int n;
};

/// A loop; its place in the list is its rank among equal periods.
struct Loop {
    int budget;
    int period;
    std::vector<Step> body;
    bool may_miss = false;  ///< its own lateness is no miss: it asks for more than its budget
    /// The whole budget comes back at each release (deferrable server), and not one period after
    /// each use (sporadic server).
    bool deferrable = false;
    int core = 0;
};

/// A device of core 0 and the server of its bottom half (PIBS, E. Missimer et al., ECRTS 2016).
struct Io {
    int budget;
    int period;
    int section = 0;  ///< so many ticks of its work, at its begin, are under lock 0
};

/// Takes core 0 for `cost`, above everything, and not again within `interval`; 0: there is none.
struct Interrupt {
    int cost = 0;
    int interval = 0;
};

struct Set {
    std::vector<Loop> loops;
    std::vector<Io> ios;
    Interrupt interrupt{};
    /// A run may be shorter than it says, by any number of ticks but the first.
    bool shorter_runs = false;
};

/// The scheduler's rules. Each is right as it stands here.
struct Rules {
    /// Idle budget is not saved up (Stanovich et al., RTAS 2010).
    bool waking_moves_refills = true;
    bool shorter_period_first = true;
    bool inheritance = true;        ///< a lock's holder has the rank of its highest waiter
    bool one_replenishment = true;  ///< a bottom half waits for used/U, even with budget left
    /// A holder without budget goes on for its waiter, on the waiter's budget. Else nobody pays.
    bool waiter_pays = true;
    /// A release that an interrupt delays has its budget from when it was due. Else the server
    /// begins when the loop wakes.
    bool nominal_release = true;
    bool loops_go_first = true;  ///< before a bottom half that works for a loop of their period
};

inline constexpr int kCores = 2, kLoops = 3, kIos = 1, kLocks = 2, kBudget = 10;
inline constexpr std::uint8_t kNobody = 0xff;

/// All times are ticks from now on, so that equal situations at different times are one state.
struct LoopState {
    std::uint8_t since = 0;  ///< ticks since its release, at most its period
    std::uint8_t active = 0;
    std::uint8_t step = 0;
    std::uint8_t left = 0;                       ///< of `run` and `suspend`
    std::uint8_t waits_for = kNobody;            ///< a lock
    std::uint8_t server_sleeps = 0;              ///< an interrupt delays what wakes it
    std::array<std::int8_t, kBudget> refills{};  ///< when each tick of budget may be spent, sorted
};
enum class IoLock : std::uint8_t { none, wants, waits, has };
struct IoState {
    std::uint8_t work = 0;
    std::uint8_t client = 0;     ///< period that it has the rank of
    std::uint8_t remaining = 0;  ///< of the present service
    std::uint8_t used = 0;
    std::uint8_t wait = 0;     ///< ticks until the present service, or the next one, may run
    std::uint8_t since = 0;    ///< ticks since the present service could run
    std::uint8_t section = 0;  ///< ticks left under the lock
    IoLock lock = IoLock::none;
};
struct State {
    std::uint8_t taken = 0;            ///< by the interrupt, so many ticks more
    std::uint8_t since_interrupt = 0;  ///< at most its interval
    std::array<LoopState, kLoops> loops{};
    std::array<IoState, kIos> ios{};
    std::array<std::uint8_t, kLocks> holder{kNobody, kNobody};
};

/// Follows every schedule of one set.
class Explorer {
  public:
    /// `state_limit`: how many states are followed at the most.
    Explorer(const Set& set, Rules rules = {}, std::size_t state_limit = 2'000'000)
        : set_(set), rules_(rules), limit_(state_limit) {}

    /// The loop that misses its period in some schedule, or loops() + the bottom half of which a
    /// service that may run does not end within its client's period; none when no schedule has a
    /// miss.
    std::optional<int> miss() {
        State first;
        for (std::size_t i = 0; i < set_.loops.size(); ++i) {
            first.loops[i].since = static_cast<std::uint8_t>(set_.loops[i].period);
        }
        first.since_interrupt = static_cast<std::uint8_t>(set_.interrupt.interval);
        push(first);
        while (!todo_.empty() && !missed_) {
            const State state = todo_.back();
            todo_.pop_back();
            choose(state);
        }
        return missed_;
    }
    [[nodiscard]] std::size_t states() const { return seen_.size(); }
    /// False: there were more states than were followed.
    [[nodiscard]] bool complete() const { return seen_.size() < limit_; }
    /// Some loop held a lock without budget, while another waited for it.
    [[nodiscard]] bool paid() const { return paid_; }

  private:
    static std::size_t index(int i) { return static_cast<std::size_t>(i); }
    [[nodiscard]] int loops() const { return static_cast<int>(set_.loops.size()); }
    [[nodiscard]] int ios() const { return static_cast<int>(set_.ios.size()); }

    // ---- the choices of one instant: who is released, which device asks ------------------------

    void choose(const State& state, int chooser) {
        if (missed_) return;
        if (chooser < loops()) {
            choose(state, chooser + 1);
            const LoopState& loop = state.loops[index(chooser)];
            if (loop.active || loop.since < set_.loops[index(chooser)].period) return;
            State released = state;
            release(released, chooser);
            choose(released, chooser + 1);
        } else if (chooser < loops() + ios()) {
            choose(state, chooser + 1);
            const int io = chooser - loops();
            if (state.ios[index(io)].work > 0) return;
            for (int client = 0; client < loops(); ++client) {
                const int period = set_.loops[index(client)].period;
                for (const int work : {1, 2 * share(io, period)}) {
                    State asked = state;
                    ask(asked, io, period, work);
                    choose(asked, chooser + 1);
                }
            }
        } else {
            State next = state;
            settle(next);
        }
    }
    /// The interrupt comes first, or not at all.
    void choose(const State& state) {
        choose(state, 0);
        if (set_.interrupt.cost == 0 || state.since_interrupt < set_.interrupt.interval) return;
        State interrupted = state;
        interrupted.taken = static_cast<std::uint8_t>(set_.interrupt.cost);
        interrupted.since_interrupt = 0;
        choose(interrupted, 0);
    }

    void release(State& state, int i) {
        LoopState& loop = state.loops[index(i)];
        loop.active = 1;
        begin_step(loop, i, 0);
        loop.server_sleeps = !rules_.nominal_release && state.taken > 0 ? 1 : 0;
        if (!loop.server_sleeps) wake(loop, i);
        begin_period(loop, i);
    }
    void begin_period(LoopState& loop, int i) {
        loop.since = 0;
        if (set_.loops[index(i)].deferrable) loop.refills.fill(0);
    }
    void wake(LoopState& loop, int i) {
        if (!rules_.waking_moves_refills || set_.loops[index(i)].deferrable) return;
        for (int k = 0; k < set_.loops[index(i)].budget; ++k) {
            std::int8_t& refill = loop.refills[index(k)];
            refill = std::max(refill, static_cast<std::int8_t>(k));
        }
    }
    void begin_step(LoopState& loop, int i, int step) {
        const auto& body = set_.loops[index(i)].body;
        loop.step = static_cast<std::uint8_t>(step);
        if (index(step) == body.size())
            loop.active = 0;
        else
            loop.left = static_cast<std::uint8_t>(body[index(step)].n);
    }
    [[nodiscard]] int share(int io, int client) const {
        const Io& server = set_.ios[index(io)];
        return std::max(1, server.budget * client / server.period);
    }
    /// One tick, or more work than one service takes, so that it is served again and again.
    void ask(State& state, int i, int client, int work) {
        IoState& io = state.ios[index(i)];
        const int section = set_.ios[index(i)].section;
        io.work = static_cast<std::uint8_t>(std::max(work, section));
        io.section = static_cast<std::uint8_t>(section);
        io.lock = section > 0 ? IoLock::wants : IoLock::none;
        open(io, i, client);
    }
    void open(IoState& io, int i, int client) {
        io.client = static_cast<std::uint8_t>(client);
        io.remaining = static_cast<std::uint8_t>(share(i, client));
        io.used = io.since = 0;
        if (!rules_.one_replenishment) io.wait = 0;
    }

    // ---- what takes no time: locks, and the begin of a suspension -------------------------------

    using Running = std::array<int, kCores>;

    /// Lets those that would run do what takes no time, as often as there is something; then one
    /// tick passes. When two cores do something at once, either may be first.
    void settle(State& state) {
        while (!missed_) {
            // Behind a run a suspension begins at once: it needs no budget.
            for (int i = 0; i < loops(); ++i) {
                const LoopState& loop = state.loops[index(i)];
                if (!loop.active || loop.waits_for != kNobody || loop.step == 0) continue;
                const Step& step = set_.loops[index(i)].body[loop.step];
                if (step.what == Do::suspend) return suspend(state, i, step.n);
            }
            if (ask_for_lock(state)) continue;
            Running running;
            int acts = -1;
            for (int core = 0; core < kCores; ++core) {
                const int runs = running[index(core)] = chosen(state, core);
                if (runs < 0 || runs >= loops()) continue;
                if (step_of(state, runs).what == Do::run) {
                    end_early(state, runs);
                    continue;
                }
                if (acts >= 0) {
                    State other_first = state;
                    if (act(other_first, runs)) settle(other_first);
                } else {
                    acts = runs;
                }
            }
            if (acts < 0) return tick(state, running);
            if (!act(state, acts)) return;
        }
    }
    /// Follows what comes when the run that loop i is in has ended already.
    void end_early(const State& state, int i) {
        if (!set_.shorter_runs || state.loops[index(i)].left == step_of(state, i).n) return;
        State next = state;
        begin_step(next.loops[index(i)], i, state.loops[index(i)].step + 1);
        unlock_all(next, i);
        settle(next);
    }
    /// The bottom half that would run asks for its lock first.
    bool ask_for_lock(State& state) {
        const int runs = chosen(state, 0);
        if (runs < loops() || state.ios[index(runs - loops())].lock != IoLock::wants) return false;
        const bool free = state.holder[0] == kNobody;
        state.ios[index(runs - loops())].lock = free ? IoLock::has : IoLock::waits;
        if (free) state.holder[0] = static_cast<std::uint8_t>(runs);
        return true;
    }
    [[nodiscard]] const Step& step_of(const State& state, int i) const {
        return set_.loops[index(i)].body[state.loops[index(i)].step];
    }
    /// False: what follows has been followed.
    bool act(State& state, int i) {
        LoopState& loop = state.loops[index(i)];
        const Step& step = step_of(state, i);
        if (step.what == Do::suspend) {
            suspend(state, i, step.n);
            return false;
        }
        if (std::uint8_t& holder = state.holder[index(step.n)]; holder != kNobody) {
            loop.waits_for = static_cast<std::uint8_t>(step.n);
        } else {
            holder = static_cast<std::uint8_t>(i);
            begin_step(loop, i, loop.step + 1);
            unlock_all(state, i);
        }
        return true;
    }
    /// Giving back takes no time, and so no budget.
    void unlock_all(State& state, int i) {
        LoopState& loop = state.loops[index(i)];
        const auto& body = set_.loops[index(i)].body;
        while (loop.active && body[loop.step].what == Do::unlock) {
            give_back(state, body[loop.step].n);
            begin_step(loop, i, loop.step + 1);
        }
    }
    void give_back(State& state, int lock) {
        state.holder[index(lock)] = kNobody;
        int next = -1;
        for (int i = 0; i < loops(); ++i) {
            if (state.loops[index(i)].waits_for == lock && (next < 0 || rank(state, i) < rank(state, next)))
                next = i;
        }
        for (int k = 0; lock == 0 && k < ios(); ++k) {
            IoState& io = state.ios[index(k)];
            if (io.lock != IoLock::waits || (next >= 0 && rank(state, next) < io_rank(state, k))) continue;
            io.lock = IoLock::has;
            state.holder[0] = static_cast<std::uint8_t>(loops() + k);
            return;
        }
        if (next < 0) return;
        state.holder[index(lock)] = static_cast<std::uint8_t>(next);
        LoopState& loop = state.loops[index(next)];
        loop.waits_for = kNobody;
        begin_step(loop, next, loop.step + 1);
    }
    /// Each length of a suspension is a schedule of its own.
    void suspend(const State& state, int i, int longest) {
        for (int length = 0; length <= longest; ++length) {
            State next = state;
            LoopState& loop = next.loops[index(i)];
            if (length == 0) {
                begin_step(loop, i, loop.step + 1);
                unlock_all(next, i);
            } else {
                loop.left = static_cast<std::uint8_t>(length);
                loop.waits_for = kSuspended;
            }
            settle(next);
        }
    }

    // ---- who runs -------------------------------------------------------------------------------

    /// Smaller goes first.
    [[nodiscard]] int own_rank(int i) const {
        const int period = i < loops() ? set_.loops[index(i)].period : 0;
        return (rules_.shorter_period_first ? period : 100 - period) * 16 + i;
    }
    [[nodiscard]] int rank(const State& state, int i) const {
        if (!rules_.inheritance) return own_rank(i);
        const bool on_own_account = i >= loops() || state.loops[index(i)].refills[0] <= 0;
        const int inherited = waiters_rank(state, i);
        return on_own_account ? std::min(own_rank(i), inherited) : std::min(inherited, kNoRank);
    }
    /// The rank of the highest that waits for loop i, or bottom half i − loops(); kNoRank: nobody
    /// waits.
    [[nodiscard]] int waiters_rank(const State& state, int i) const {
        int best = kNoRank;
        for (int lock = 0; lock < kLocks; ++lock) {
            if (state.holder[index(lock)] != i) continue;
            for (int j = 0; j < loops(); ++j) {
                if (j != i && state.loops[index(j)].waits_for == lock) best = std::min(best, rank(state, j));
            }
            for (int k = 0; lock == 0 && k < ios(); ++k) {
                if (state.ios[index(k)].lock == IoLock::waits) best = std::min(best, io_rank(state, k));
            }
        }
        return best;
    }
    /// The loop that pays for a tick of loop i: itself, or, without budget, its highest waiter; −1:
    /// nobody can.
    [[nodiscard]] int payer(const State& state, int i) const {
        if (state.loops[index(i)].refills[0] <= 0) return i;
        const int inherited = waiters_rank(state, i);
        if (inherited == kNoRank) return -1;
        const int waiter = inherited % 16;
        if (waiter >= loops() || set_.loops[index(waiter)].core != set_.loops[index(i)].core) return -1;
        return state.loops[index(waiter)].refills[0] <= 0 ? waiter : -1;
    }
    [[nodiscard]] int io_rank(const State& state, int io) const {
        const int period = state.ios[index(io)].client;
        const int place = rules_.loops_go_first ? loops() + io : io - ios();
        return (rules_.shorter_period_first ? period : 100 - period) * 16 + place;
    }
    /// The loop, or loops() + the bottom half, that has the core; −1: it idles.
    [[nodiscard]] int chosen(const State& state, int core) const {
        if (core == 0 && state.taken > 0) return -1;
        int best = -1, best_rank = 0;
        const auto offer = [&](int who, int its_rank) {
            if (best < 0 || its_rank < best_rank) best = who, best_rank = its_rank;
        };
        for (int i = 0; i < loops(); ++i) {
            const LoopState& loop = state.loops[index(i)];
            if (set_.loops[index(i)].core != core) continue;
            if (loop.active && loop.waits_for == kNobody && payer(state, i) >= 0) offer(i, rank(state, i));
        }
        for (int k = 0; core == 0 && k < ios(); ++k) {
            const IoState& io = state.ios[index(k)];
            if (io.work == 0 || io.lock == IoLock::waits) continue;
            const int inherited = waiters_rank(state, loops() + k);
            if (io.wait == 0)
                offer(loops() + k, std::min(io_rank(state, k), inherited));
            else if (inherited != kNoRank)
                offer(loops() + k, inherited);
        }
        return best;
    }

    // ---- one tick -------------------------------------------------------------------------------

    void tick(State& state, const Running& running) {
        for (const int runs : running) {
            if (runs >= 0 && runs < loops()) run_loop(state, runs);
        }
        for (int k = 0; k < ios(); ++k) {
            const bool runs = running[0] == loops() + k;
            IoState& io = state.ios[index(k)];
            const bool ends = runs && io.section > 0 && --io.section == 0;
            pass(io, k, runs);
            if (!ends) continue;
            io.lock = IoLock::none;
            give_back(state, 0);
        }
        for (int i = 0; i < loops(); ++i) pass(state, i);
        if (state.since_interrupt < set_.interrupt.interval) ++state.since_interrupt;
        if (state.taken > 0 && --state.taken == 0) wake_servers(state);
        push(state);
    }
    /// The interrupt is over.
    void wake_servers(State& state) {
        for (int i = 0; i < loops(); ++i) {
            if (std::exchange(state.loops[index(i)].server_sleeps, std::uint8_t{0}))
                wake(state.loops[index(i)], i);
        }
    }
    void pass(State& state, int i) {
        LoopState& loop = state.loops[index(i)];
        const int period = set_.loops[index(i)].period;
        // For an idle loop only what is still to come counts: waking moves the rest.
        const bool deferrable = set_.loops[index(i)].deferrable;
        const int oldest = !deferrable && (loop.active || !rules_.waking_moves_refills) ? -period : 0;
        for (std::int8_t& refill : loop.refills)
            if (refill != kSpent) refill = static_cast<std::int8_t>(std::max(refill - 1, oldest));
        if (loop.since < period) ++loop.since;
        if (loop.active && loop.waits_for == kSuspended && --loop.left == 0) {
            loop.waits_for = kNobody;
            begin_step(loop, i, loop.step + 1);
            unlock_all(state, i);
            if (loop.active) wake(loop, i);
        }
        if (!loop.active || loop.since < period) return;
        if (set_.loops[index(i)].may_miss)
            begin_period(loop, i);
        else
            missed_ = i;
    }
    void run_loop(State& state, int i) {
        const int pays = payer(state, i);
        paid_ |= pays != i;
        if (pays == i || rules_.waiter_pays) spend(state.loops[index(pays)], pays);
        LoopState& loop = state.loops[index(i)];
        if (--loop.left > 0) return;
        begin_step(loop, i, loop.step + 1);
        unlock_all(state, i);
    }
    /// The first tick of budget comes back one period later.
    void spend(LoopState& loop, int i) {
        const auto budget = loop.refills.begin() + set_.loops[index(i)].budget;
        std::rotate(loop.refills.begin(), loop.refills.begin() + 1, budget);
        *(budget - 1) = set_.loops[index(i)].deferrable
                            ? kSpent
                            : static_cast<std::int8_t>(*(budget - 1) + set_.loops[index(i)].period);
    }
    /// What was used comes back at (begin of the service) + used/U. What it runs without budget,
    /// for one that waits for its lock, comes back later by as much.
    void pass(IoState& io, int i, bool runs) {
        if (io.wait > 0) {
            --io.wait;
            if (!runs) return;
            const Io& server = set_.ios[index(i)];
            io.wait =
                static_cast<std::uint8_t>(io.wait + (server.period + server.budget - 1) / server.budget);
            if (--io.work == 0) io.remaining = io.used = io.since = io.client = 0;
            return;
        }
        if (io.work == 0) return;
        ++io.since;
        if (!runs) {
            if (io.since >= io.client) missed_ = loops() + i;
            return;
        }
        --io.work;
        ++io.used;
        if (--io.remaining > 0 && io.work > 0) {
            if (io.since >= io.client) missed_ = loops() + i;
            return;
        }
        const Io& server = set_.ios[index(i)];
        const int back = (io.used * server.period + server.budget - 1) / server.budget;
        io.wait = static_cast<std::uint8_t>(std::max(0, back - io.since));
        if (io.work > 0)
            open(io, i, io.client);
        else
            io.remaining = io.used = io.since = io.client = 0;
    }

    // ---- states seen ----------------------------------------------------------------------------

    void push(const State& state) {
        static_assert(std::has_unique_object_representations_v<State>);
        const std::string key{reinterpret_cast<const char*>(&state), sizeof state};
        if (seen_.size() < limit_ && seen_.insert(key).second) todo_.push_back(state);
    }

    static constexpr std::uint8_t kSuspended = 0xfe;
    static constexpr int kNoRank = 1 << 20;
    static constexpr std::int8_t kSpent = 100;  // until the next release
    Set set_;
    Rules rules_;
    std::size_t limit_;
    std::vector<State> todo_;
    std::unordered_set<std::string> seen_;
    std::optional<int> missed_;
    bool paid_ = false;
};

}  // namespace qduino::sched::model
