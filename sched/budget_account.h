// The account of one thread's budget: events in, effects out.
//
// A thread keeps itself to its budget with a timer. Three things make that hard: the timer knows
// the wall clock, but the budget is CPU time; the thread may wait without saying so; and asking a
// clock costs a noticeable part of a short budget. So the account reads no clock and sets no timer.
// It is told of each event with the clocks' readings, and returns one effect. budget_shell.h reads
// the clocks and carries the effect out.
//
// The timer. A thread cannot use more CPU time than the wall time that passes. So a timer that is
// set to what is left never comes after the end of the budget. It comes early when the thread was
// preempted; then it is set to the rest. When the thread waits until a known instant, the timer is
// set before the wait, to where the budget will end: nothing stands between the wake-up and the
// loop's first instruction. The server is told of that wake-up at the next event.
//
// Waits that nobody announces, for a bus or a socket, show in the thread's count of voluntary
// context switches. When that count grew, the thread may have waited at any time since the last
// event. What it used counts from `now − used`, the latest possible begin: a refill then comes back
// late, never early.
//
// What holds the core at the end of an announced wait (an interrupt, a loop of higher rank) makes
// the thread late, and not its server: that begins when the wait was to end. Else one late wake-up
// would delay the budget of every later release.
//
// The way into a sleep and out of it costs CPU time, both for an announced wait and for the sleep
// of a spent budget. Admission counts one such way in each period beside the budget (admission.h).
// So the account leaves out one in each period, or two after a period without, and charges the
// others. All else is charged: nothing is counted twice. If every sleep for a spent budget were
// charged, a loop whose budget is shorter than that way would not get on any more once it had
// overrun: it would pay with each budget for the sleep before. A loop can make its own sleeps for
// its budget as often as it likes, so of the way through one no more than a thousandth of its
// period is left out, or 10 µs: less than the warden overlooks (budget_watch.h).
//
// The way into that sleep, where it is charged, is charged when the sleep ends, against the
// replenishment that it waited for. A thread that slept to exactly that instant would then be short
// by the charge, and would sleep again. Each such sleep costs as much as it gains, so the thread
// would pay with its whole budget for sleeps. It therefore sleeps `rest` longer, which is more than
// the way in costs.
//
// Locks. A thread that sleeps with a lock holds up everybody who waits for the lock, whatever their
// priority. If it went on at its rank instead, it would hold up those who want no lock. So a thread
// whose budget ends while it holds one steps back: it goes on where nobody else wants the core, and
// at the rank of whoever waits for the lock (the board's inheritance). It may overrun by one budget
// each time that it holds any, or by as much as its sections say (a handler's may be longer than
// its budget); the server charges the overrun forward.
//
// Invariants: CPU time that an event tells of is charged exactly once, except the ways through
// sleeps that admission counts. A thread is throttled only while its server has nothing available.
#pragma once

#include <cstdint>

#include "base/time.h"
#include "sched/server.h"

namespace qduino::sched {

/// What the account must know of the thread, read together.
struct BudgetReading {
    Instant now{};
    Nanoseconds cpu{};          ///< CPU time that the thread has used, ever
    std::int64_t switches = 0;  ///< how often it gave the CPU up of its own accord, ever
};

/// What is to be done with the timer, or the thread.
struct BudgetEffect {
    enum class Kind : std::uint8_t {
        none,         ///< the timer stays as it is
        disarm,       ///< the timer is not to come
        arm_in,       ///< the timer is to come `in` from now
        arm_at,       ///< the timer is to come at `at`
        sleep_until,  ///< the thread is to sleep until `at`, and then to call resumed()
    };
    Kind kind = Kind::none;
    Nanoseconds in{};
    Instant at{};
    /// Any kind but none: until the next effect the thread has no rank but what it inherits.
    bool steps_back = false;
    constexpr bool operator==(const BudgetEffect&) const = default;
};

/// One owner at a time: the events of one thread, in their order. No call blocks, allocates or
/// calls the system: it may be called in a signal's handler or an interrupt. Instants that run back
/// a little are taken as the last one.
class BudgetAccount {
  public:
    // timer, woke, resumed ──► has it budget? ─┬─ yes ───────────────────► running
    //                                          ├─ no, but it holds a lock ► overrunning
    //                                          └─ no ────────────────────► throttled ── resumed ─►
    //
    // blocks ──► will it have budget then? ─┬─ yes ───────────► armed_ahead ── woke ─► woken
    //                                       └─ no, or unknown ► waiting ── woke ─► has it budget?
    //
    // The next event after `woken` tells the server of the wake-up first, and goes on as if
    // running.
    enum class Phase : std::uint8_t {
        running,  ///< the timer is set to the end of the budget
        /// No budget, but a lock: it has stepped back. The timer is set to the end of what it may
        /// overrun.
        overrunning,
        throttled,    ///< no budget: it sleeps until the replenishment
        waiting,      ///< an announced wait; the timer is off
        armed_ahead,  ///< an announced wait; the timer is set to the end of the budget after it
        woken,        ///< runs after such a wait, and the server does not know yet
    };

    BudgetAccount() = default;  ///< for containers only: assign before use
    /// The account of a thread that runs, from `reading` on. A throttled thread sleeps `rest`
    /// longer than to its replenishment.
    BudgetAccount(const Server& server, const BudgetReading& reading, Nanoseconds rest = {});

    /// The timer came, or there is another reason to look at the account. Contract: the thread
    /// neither waits nor is throttled.
    BudgetEffect timer(const BudgetReading& reading);
    /// The thread is about to wait until `until`; kForever: nobody knows how long. Contract: as
    /// above.
    BudgetEffect blocks(const BudgetReading& reading, Instant until);
    /// The wait ended, with so much CPU time used. Before `until` only by as much as two clocks
    /// differ. Contract: it waited.
    BudgetEffect woke(Instant now, Nanoseconds cpu);
    /// The sleep that the last effect asked for is over. Contract: throttled.
    BudgetEffect resumed(const BudgetReading& reading);
    /// An I/O VCPU's thread has another budget and period from now on. Contract: as of timer().
    BudgetEffect change(const BudgetReading& reading, VcpuParameters parameters);
    /// The thread begins the release that was due at `nominal`.
    void release(Instant nominal);
    /// Its sections under locks last so long, all together (blocking.h).
    void may_overrun(Nanoseconds longest) { overrun_ = longest; }
    /// The thread is about to take a lock. Nests.
    void holds();
    /// It has released one. True: it overran and holds none any more; call timer() at once.
    [[nodiscard]] bool releases();

    [[nodiscard]] Phase phase() const { return phase_; }
    /// An announced wait.
    [[nodiscard]] bool waits() const { return phase_ == Phase::waiting || phase_ == Phase::armed_ahead; }
    [[nodiscard]] const Server& server() const { return server_; }

  private:
    BudgetEffect go_on();
    void settle(const BudgetReading& reading);
    void charge(Instant end, Nanoseconds used);
    void take_up_work();
    [[nodiscard]] bool admission_has_a_way(Instant woke_at);
    [[nodiscard]] Nanoseconds longest_way_left_out() const;

    Server server_;
    Nanoseconds rest_{};
    Phase phase_ = Phase::running;
    Instant settled_at_{};         // the last instant that the account knows of
    Nanoseconds charged_to_{};     // on the thread's CPU clock: what came before is settled
    Instant due_ = kForever;       // an announced wait: when it was to end
    Instant woke_at_{};            // woken: when
    Nanoseconds cpu_at_wake_{};    // woken: the same clock after the wait
    std::int64_t switches_ = 0;    // voluntary switches that the account knows of
    Instant next_admitted_way_{};  // when admission has counted the way through one more sleep
    int locks_ = 0;                // held
    Nanoseconds overrun_{};        // what its sections say
    Nanoseconds grace_{};          // what may still be overrun before the last of them is released
};

}  // namespace qduino::sched
