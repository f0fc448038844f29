// Keeps a thread to its budget: the thread itself does, in the handler of a timer.
//
//   timer (wall time) ─┐ armed with what is left           ┌─ armed again
//   ███████████████████▼ budget spent: sleep in the handler ▼█████████████
//   └── CPU clock read: `used` ──► sched::SporadicServer ──► next replenishment
//
// In so much wall time the thread cannot have consumed more CPU time: the timer never comes after the
// budget's end. If it comes before (the thread was preempted meanwhile), the CPU clock says so and the timer
// is armed with the rest. Only high-resolution timers and system calls of one's own thread are needed: no
// privilege, no kernel patch. (Timers on the thread's CPU clock would spare the early shots, but stock
// kernels look at them at the tick, 1–10 ms apart; so does SCHED_DEADLINE, without its HRTICK feature.)
//
// Accounting. The sporadic server must be told when the thread blocks, or an old refill would come back
// early. sleep_until() tells it. Waits that nobody announces (a bus, a lock, a socket) are found by the
// thread's count of voluntary context switches: when it grew, what was used since the last look counts from
// the latest instant at which it can have begun, `now − used`. That errs on the late side.
//
// The way into a wait and out of it takes some 20 us of the thread's CPU time. Admission counts one in each period beside the
// budget (sched/admission.h), so one is not charged; a loop that waits more often pays for the others.
//
// Time that a hypervisor takes from a virtual machine and does not report looks like the thread's own: it is charged, and paid
// back like any overrun.
//
// Locks. A thread that slept for its budget while it holds a lock would hold up whoever waits for it, whatever its
// priority: the kernel's priority inheritance cannot run a thread that sleeps. So the sleep is put off until the last
// unlock, for one budget more at most (a loop that hangs in its critical section is throttled all the same); what was
// overrun is charged forward by the server.
//
// All of it runs on the thread it is about; the handler is kept out of the ordinary path by a flag, not a
// lock. The handler calls only clock_gettime, clock_nanosleep, timer_settime and getrusage: async-signal-safe
// on Linux.
//
// Cost, measured on a 2-core VM (kernel 6.18): 3 µs per release; 30–40 µs per enforcement, nearly all of it
// the virtual machine's timer interrupt (13 µs) and the way into and out of the sleep (17 µs); charged to the
// loop itself. Hence no budget under 100 µs on a shared core.
#pragma once

#include <time.h>

#include <atomic>
#include <csignal>
#include <cstdint>
#include <variant>

#include "base/result.h"
#include "base/time.h"
#include "board/types.h"
#include "sched/pibs.h"
#include "sched/sporadic_server.h"

namespace qduino::board::linux {

class BudgetKeeper {
  public:
    BudgetKeeper() = default;
    ~BudgetKeeper() { stop(); }
    BudgetKeeper(const BudgetKeeper&) = delete;
    BudgetKeeper& operator=(const BudgetKeeper&) = delete;

    /// Begins to keep the calling thread to the spec's budget: a main VCPU by the sporadic server, an I/O
    /// VCPU by PIBS. Error: unavailable, when the kernel has no timer left.
    Result<void> start(const VcpuSpec& spec);
    /// Ends it. By the same thread.
    void stop();
    [[nodiscard]] bool running() const { return running_; }

    /// Around a wait of the thread, which ends at `until` or, kForever, nobody knows when.
    void before_block(Instant until);
    /// The wait ended at `now`.
    void after_block(Instant now);

    /// Before the thread takes a lock, and after it has released it. Nests.
    void begin_hold();
    void end_hold();

    /// The signal that a budget's end comes as. It is SIGRTMIN + 3, and what SIGRTMIN is glibc decides at run time.
    [[nodiscard]] static int signal_number() { return SIGRTMIN + 3; }

    /// How often the budget was spent and the thread slept for it. Readable from any thread.
    [[nodiscard]] std::uint64_t throttled() const { return throttled_.load(std::memory_order_relaxed); }
    /// CPU time charged so far. Readable from any thread.
    [[nodiscard]] Nanoseconds charged() const {
        return Nanoseconds{charged_ns_.load(std::memory_order_relaxed)};
    }

  private:
    static void on_timer(int, siginfo_t*, void*);
    [[nodiscard]] Instant account_now() const;
    bool analysed_wait(Instant now);
    void charge(Instant now, Nanoseconds used);
    [[nodiscard]] Nanoseconds used_until(Instant now) const;
    void charge_run(Instant now, Nanoseconds used);
    void take_up_work();
    void settle(Instant now);
    void throttle_and_arm();
    void arm(Nanoseconds in);
    bool overrun_while_holding();
    void leave_ordinary_path();

    [[nodiscard]] Nanoseconds available(Instant now) const;
    [[nodiscard]] Instant next_replenishment() const;
    void server_block(Instant now);
    void server_unblock(Instant now);
    void unblock(sched::SporadicServer& server, Instant now) const;
    void unblock(sched::Pibs& server, Instant now) const;
    bool arm_for_wake(Instant now, Instant until);

    std::variant<sched::SporadicServer, sched::Pibs> server_;
    Nanoseconds period_{};
    bool woken_ = false;        // at settled_at_, and the server does not know yet
    bool armed_ahead_ = false;  // the timer is set for a thread that wakes when it said
    Nanoseconds budget_{};
    timer_t timer_{};
    bool running_ = false;
    volatile std::sig_atomic_t busy_ = 0;    // the ordinary path works on the account
    volatile std::sig_atomic_t missed_ = 0;  // the timer came meanwhile
    volatile std::sig_atomic_t locks_held_ = 0;
    volatile std::sig_atomic_t overrunning_ = 0;  // its budget is spent, and it goes on with a lock
    Nanoseconds overrun_ends_{};                  // on its CPU clock
    Nanoseconds cpu_before_{};                    // CPU clock at the last settlement
    Nanoseconds cpu_at_wake_{};                   // and after the wait since then
    Instant next_analysed_{};   // when the analysis has counted the way through one more wait
    long switches_before_ = 0;  // voluntary context switches at the last settlement
    Instant settled_at_{};
    std::atomic<std::uint64_t> throttled_{0};
    std::atomic<std::int64_t> charged_ns_{0};
    static thread_local BudgetKeeper* mine_;
};

}  // namespace qduino::board::linux
