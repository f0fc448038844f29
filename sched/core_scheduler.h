// The scheduler of one core: rate-monotonic over main VCPUs (sporadic servers) and I/O VCPUs
// (PIBS).
//
// Rate-monotonic (Liu, Layland, JACM 1973): the shorter the period, the higher the priority; at
// equal periods the lower id goes first. While an I/O VCPU works, it has the period of the main
// VCPU that it works for (pibs.h).
//
//              wake  ┌──────────┐  decide  ┌─────────┐
//   blocked ────────►│ runnable │─────────►│ running │
//      ▲             └──────────┘◄─────────└─────────┘
//      │                preempted, throttled    │
//      └──────────────── block ─────────────────┘
//
// A throttled VCPU stays runnable; decide() skips it until its replenishment.
//
// The caller keeps the locks. Three things about them are this class's work:
// - wait_for_lock(): a loop that waits for a lock does not run, and its server goes on as if it
//   did. Otherwise its budget would come back late, and the next release would pay for the wait.
// - inherit(): the holder of a lock takes the rank of its highest waiter (L. Sha, R. Rajkumar, J.
//   Lehoczky, "Priority inheritance protocols", IEEE Trans. Computers, 1990).
// - A holder whose budget is spent runs on the budget, and at the rank, of its highest waiter on
//   this core. So nobody waits for its replenishment, and only those pay who share the lock with
//   it (G. Lamastra, G. Lipari, L. Abeni, "A bandwidth inheritance algorithm", RTSS 2001). A loop
//   that keeps what it declares is never such a holder (blocking.h).
// - Where the highest waiter is of another core, nobody here can pay. Such a holder overruns, by
//   one budget at most, and its own replenishments come the later.
// - A handler may be such a holder however well it keeps to what it declares. It overruns for its
//   waiter, for as long as its sections say (the option `overrun`), and pays for that later.
//
// The caller keeps the clock. It calls decide(now), runs the chosen VCPU until `until` at the
// latest (or until something wakes or blocks), then calls again. Between two calls the chosen VCPU
// counts as running all the time, less what account() is told was taken from it.
//
// Invariants: at most one VCPU runs. It is the eligible runnable VCPU of highest priority at the
// last decide(). Every nanosecond that a VCPU ran is charged to its server, once.
#pragma once

#include <array>
#include <compare>
#include <cstdint>
#include <optional>

#include "base/fixed_vector.h"
#include "base/time.h"
#include "sched/server.h"
#include "sched/vcpu.h"

namespace qduino::sched {

struct Decision {
    std::optional<VcpuId> vcpu;  ///< none: the core idles
    /// Decide again at this instant at the latest: the chosen VCPU's budget ends, or a
    /// replenishment may change the choice. kForever when only a wake or a block can change it.
    Instant until = kForever;
    bool operator==(const Decision&) const = default;
};

/// The order in which VCPUs run: the smaller rank first. A VCPU's own rank is its period and its
/// id.
struct Rank {
    Nanoseconds period = Nanoseconds::max();
    VcpuId id = 0xff;
    constexpr auto operator<=>(const Rank&) const = default;
};

struct MainVcpuOptions {
    bool owns_core = false;   ///< never throttled (needs budget == period)
    bool deferrable = false;  ///< the whole budget comes back at each release
    SporadicServerOptions server{};
};

struct IoVcpuOptions {
    Nanoseconds activation{};     ///< pibs.h
    Nanoseconds client_period{};  ///< pibs.h
    Nanoseconds overrun{};        ///< for those that wait for its locks; 0: it says nothing of them
};

/// One owner at a time. No call blocks or allocates; each is O(VCPUs of the core).
/// Contract: `now` does not run backwards.
class CoreScheduler {
  public:
    CoreScheduler();

    /// Adds a blocked main VCPU with a full budget. False, and nothing changed, when the id is
    /// taken, the parameters are not valid, the table is full, or owns_core is asked with budget <
    /// period. Does not test whether the core can take the VCPU: that is admission.h.
    [[nodiscard]] bool add(VcpuId id, VcpuParameters parameters, Instant now = kEpoch,
                           MainVcpuOptions options = {});
    /// Adds an idle I/O VCPU. False as above.
    [[nodiscard]] bool add_io(VcpuId id, VcpuParameters parameters, Instant now = kEpoch,
                              IoVcpuOptions options = {});

    /// Main VCPU `id` has work. No effect if it already had. For an I/O VCPU: work at its own
    /// period.
    void wake(VcpuId id, Instant now) { wake(id, now, now); }
    /// The same; the work was due at `due`, and what held the core meanwhile (an interrupt, the
    /// caller's own way here) made `now` of it. The server begins when the work was due: else one
    /// late wake-up would delay the budget of every later release. `due` counts from the last
    /// block() on, and to `now` at most.
    void wake(VcpuId id, Instant now, Instant due);
    /// I/O VCPU `id` has work on behalf of a main VCPU of period `client_period`, of this core or
    /// another.
    void wake_io(VcpuId id, Instant now, Nanoseconds client_period);
    /// I/O VCPU `id` has another budget and period from now on.
    void change_io(VcpuId id, VcpuParameters parameters, Instant now);
    /// Main VCPU `id` begins the release that was due at `nominal` (server.h).
    void release(VcpuId id, Instant nominal, Instant now);
    /// VCPU `id`, main or I/O, has no work left.
    void block(VcpuId id, Instant now);
    /// VCPU `id` pays `cost` beside the time that it runs, out of the budgets to come if it must.
    void charge(VcpuId id, Nanoseconds cost, Instant now);

    /// Main VCPU `id` waits for a lock from `now` on, or was given it. It has work all the same.
    void wait_for_lock(VcpuId id, bool waits, Instant now);
    /// From the next decide() on: the highest rank of those that wait for a lock of `id`, in
    /// chains, too. Rank{}: nobody waits.
    void inherit(VcpuId id, Rank rank);

    /// Charges the running VCPU for the time since the last call, less `stolen`: interrupts that
    /// the core served meanwhile (0 <= stolen <= the time passed). The calls above and decide()
    /// account by themselves, with nothing stolen.
    void account(Instant now, Nanoseconds stolen = Nanoseconds{0});
    /// The VCPU that runs from `now` on. Accounts first.
    Decision decide(Instant now);

    /// The VCPU that the last decide() chose and that has not blocked since.
    [[nodiscard]] std::optional<VcpuId> running() const;
    /// Contract for all of these: `id` was added.
    /// Budget left at `now`; when that is spent, its highest waiter's; Nanoseconds::max() for a
    /// VCPU that owns the core.
    [[nodiscard]] Nanoseconds available(VcpuId id, Instant now) const;
    [[nodiscard]] Instant next_replenishment(VcpuId id) const;
    [[nodiscard]] Nanoseconds consumed(VcpuId id) const;  ///< charged ever
    [[nodiscard]] bool contains(VcpuId id) const { return slots_[id] != kNoSlot; }
    [[nodiscard]] const Server& server(VcpuId id) const { return at(id).server; }

  private:
    struct Vcpu {
        VcpuId id = 0;
        bool owns_core = false;
        bool waits_for_lock = false;
        Instant blocked_at = kEpoch;  // the last time
        Rank inherited{};
        Nanoseconds overrun{};  // of an I/O VCPU
        /// What it may still overrun while somebody waits for it.
        Nanoseconds grace{};
        Nanoseconds owned_consumed{};  // an owning VCPU has no server to charge
        Server server{};
    };
    static constexpr std::size_t kLimit = kMainVcpuLimit + kIoVcpuLimit;
    static constexpr std::uint8_t kNoSlot = 0xff;

    [[nodiscard]] Vcpu& at(VcpuId id);
    [[nodiscard]] const Vcpu& at(VcpuId id) const;
    void insert(const Vcpu& vcpu);
    /// It has no budget, and goes on for its waiter.
    [[nodiscard]] bool overruns(const Vcpu& vcpu, Instant now) const;
    /// The one that pays for `vcpu` at `now`: itself, or when it may overrun no more, its highest
    /// waiter on this core.
    [[nodiscard]] const Vcpu& payer(const Vcpu& vcpu, Instant now) const;
    [[nodiscard]] static Rank own_rank(const Vcpu& vcpu);
    [[nodiscard]] Rank rank_of(const Vcpu& vcpu, Instant now) const;
    [[nodiscard]] Nanoseconds available(const Vcpu& vcpu, Instant now) const;
    [[nodiscard]] bool is_ready(const Vcpu& vcpu) const {
        return vcpu.server.has_work() && !vcpu.waits_for_lock;
    }
    [[nodiscard]] const Vcpu* highest(Instant now) const;
    [[nodiscard]] Instant next_change(const Vcpu* chosen, Instant now) const;

    FixedVector<Vcpu, kLimit> vcpus_;
    std::array<std::uint8_t, 256> slots_{};  // id → index in vcpus_
    std::uint8_t running_ = kNoSlot;
    std::uint8_t paying_ = kNoSlot;  // for the running one
    std::size_t main_count_ = 0;
    std::size_t io_count_ = 0;
    Instant accounted_until_ = Instant::min();
};

}  // namespace qduino::sched
