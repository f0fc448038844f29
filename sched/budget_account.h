// The account of one thread's budget: events in, effects out.
//
// A thread keeps itself to its budget by a timer. The difficulty is that the timer knows the wall clock and the budget is
// CPU time, that the thread waits without saying so, and that asking any clock costs as much as a short budget. So the
// account works with what it is told, and puts off what can wait. It reads no clock and sets no timer: budget_shell.h
// does both, and carries out the effect that each event returns.
//
//                      blocks(), with budget at the wake          woke()
//        ┌───────────────────────────► armed_ahead ─────────────────► woken ──┐ next event
//        │             blocks()                        woke()                 │
//     running ────────────────────────► waiting ──────────────┐               │
//      ▲ │ ▲ └──────────────────────────────────────────────┐ ▼               ▼
//      │ │ └─────────────── budget left ─────────────── is there budget? ◄────┘
//      │ │                                                │ no          │ no, and it holds a lock
//      │ │ timer()                       sleep_until      ▼             ▼
//      │ └──────────────► (settles)      ┌────────── throttled      overrunning ──► timer(), releases()
//      └───── resumed(): budget ─────────┘
//
// The timer. In so much wall time the thread cannot have used more CPU time: set to what is left, the timer never comes
// after the budget's end. It comes before when the thread was preempted; then it is set to the rest. For a wait whose
// end is known it is set before the wait, to where the budget will end (`armed_ahead`): nothing then stands between the
// wake-up and the loop's first instruction, and the server is told of the wake-up at the next event (`woken`).
//
// Waits that nobody announces (a bus, a socket) show in the thread's count of voluntary context switches. When it grew,
// what was used since the last look counts from the latest instant at which it can have begun, `now − used`: late, never early.
//
// The way into an announced wait and out of it costs CPU time. Admission counts one such way in each period beside the
// budget (admission.h), so one in each period is not charged, or two after a period without; every other one is.
//
// Locks. Who sleeps while it holds a lock holds up all who wait for it, whatever their priority. So a thread whose budget
// ends then goes on until it releases the last lock, by one budget for each time that it holds any (`overrunning`); the
// server charges the overrun forward.
//
// Invariants: every nanosecond of CPU time that an event tells of is charged once, but for the ways through waits above;
// a thread is throttled only while its server has nothing available.
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
    constexpr bool operator==(const BudgetEffect&) const = default;
};

/// One owner at a time: the events of one thread, in their order. No call blocks, allocates or calls the system: it may
/// be called in a signal's handler or an interrupt. Instants that run back a little are taken as the last one.
class BudgetAccount {
  public:
    enum class Phase : std::uint8_t {
        running,      ///< the timer is set to the end of its budget
        waiting,      ///< an announced wait; the timer is off
        armed_ahead,  ///< an announced wait; the timer is set to where the budget ends after it
        woken,        ///< runs after such a wait, and its server does not know yet
        overrunning,  ///< without budget, but with a lock; the timer is set to the end of that
        throttled,    ///< without budget: sleeps
    };

    BudgetAccount() = default;  ///< for containers only: assign before use
    /// Of a thread that runs, from `reading` on.
    BudgetAccount(const Server& server, const BudgetReading& reading);

    /// The timer came, or there is another reason to look at the account. Contract: the thread neither waits nor is throttled.
    BudgetEffect timer(const BudgetReading& reading);
    /// The thread is about to wait until `until`; kForever: nobody knows how long. Contract: as above.
    BudgetEffect blocks(const BudgetReading& reading, Instant until);
    /// The wait ended, with so much CPU time used. Before `until` only by as much as two clocks differ. Contract: it waited.
    BudgetEffect woke(Instant now, Nanoseconds cpu);
    /// The sleep that the last effect asked for is over. Contract: throttled.
    BudgetEffect resumed(const BudgetReading& reading);
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
    [[nodiscard]] bool admission_has_this_wait();

    Server server_;
    Phase phase_ = Phase::running;
    Instant settled_at_{};          // the last instant that the account knows of
    Nanoseconds charged_to_{};      // on the thread's CPU clock: what came before is settled
    Instant woke_at_{};             // woken: when
    Nanoseconds cpu_at_wake_{};     // woken: the same clock after the wait
    std::int64_t switches_ = 0;     // voluntary switches that the account knows of
    Instant next_admitted_wait_{};  // when admission has counted the way through one more wait
    int locks_ = 0;                 // held
    Nanoseconds grace_{};           // what may still be overrun before the last of them is released
};

}  // namespace qduino::sched
