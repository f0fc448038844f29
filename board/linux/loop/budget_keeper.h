// Keeps a thread to its budget: the thread itself does, in the handler of a timer.
//
//   timer (wall time) ─┐ armed with what is left           ┌─ armed again
//   ███████████████████▼ budget spent: sleep in the handler ▼█████████████
//   └── clocks read ──► sched::BudgetAccount ──► next replenishment
//
// The account is sched/'s (budget_account.h), and so is the shell that keeps handler and path apart
// (budget_shell.h). Here are the clocks, the timer and the sleep of stock Linux. Only
// high-resolution timers and system calls of one's own thread are needed: no privilege, no kernel
// patch. (Timers on the thread's CPU clock would spare the shots that come early, but stock kernels
// look at them at the tick, 1–10 ms apart; so does SCHED_DEADLINE, without its HRTICK feature.)
//
// The sketch can take the signal, its handler or the timer from it. Then the warden keeps the
// thread to its budget from outside (warden.h).
//
// Time that the computer takes while the thread runs may look like the thread's own. Kernels with
// CONFIG_PARAVIRT_TIME_ACCOUNTING leave out of its CPU time what a hypervisor says that it took,
// those with CONFIG_IRQ_TIME_ACCOUNTING what interrupts took (`qduino doctor` has both). What is
// left is charged, and paid back like any overrun. It is known as well: the thread uses more than
// the timer had left, which no code of its own can do but in one long system call (beyond()).
//
// The handler calls only clock_gettime, clock_nanosleep, timer_settime and getrusage:
// async-signal-safe on Linux.
//
// Cost, measured on a 2-core VM (kernel 6.18): 3 µs per release; 30–40 µs per enforcement, nearly
// all of it the virtual machine's timer interrupt (13 µs) and the way into and out of the sleep (17
// µs). Beside four busy processes on a busy host it was 60 and 100 to 200 µs.
#pragma once

#include <sched.h>
#include <time.h>

#include <atomic>
#include <csignal>
#include <cstdint>
#include <optional>
#include <string_view>

#include "base/result.h"
#include "base/time.h"
#include "board/linux/loop/parameters_mail.h"
#include "board/linux/pin/signs_of_life.h"
#include "board/types.h"
#include "sched/budget_shell.h"

namespace qduino::board::linux {

class BudgetKeeper {
  public:
    BudgetKeeper() = default;
    ~BudgetKeeper() { stop(); }
    BudgetKeeper(const BudgetKeeper&) = delete;
    BudgetKeeper& operator=(const BudgetKeeper&) = delete;

    /// Begins to keep the calling thread to the spec's budget: a main VCPU by the sporadic server,
    /// an I/O VCPU by PIBS. Error: unavailable, when the kernel has no timer left.
    /// `priority`: what the thread has of SCHED_FIFO; 0: nothing. `life` (null: nobody) is told of
    /// its sleeps.
    Result<void> start(const VcpuSpec& spec, int priority, SignsOfLife* life = nullptr);
    /// Ends it. By the same thread.
    void stop();
    [[nodiscard]] bool running() const { return running_; }

    // By the thread that is kept. Without effect while none is.
    /// Around a wait of the thread, which ends at `until` or, kForever, nobody knows when.
    void before_block(Instant until) {
        if (running_) shell_.before_wait(until);
    }
    /// The wait ended at `now`.
    void after_block(Instant now) {
        if (!running_) return;
        shell_.after_wait(now);
        take_change();
    }
    /// The thread begins the release that was due at `nominal`.
    void begin_release(Instant nominal) {
        if (running_) shell_.begin_release(nominal);
    }
    /// Before the thread takes a lock, and after it has released it. Nests.
    void begin_hold() {
        if (running_) shell_.begin_hold();
    }
    void end_hold() {
        if (running_) shell_.end_hold();
    }

    /// The thread, an I/O VCPU's, is to have another budget and period. From any one thread at a
    /// time. Taken up when its next wait, or its budget, ends: no service begins with the old ones.
    void change(sched::VcpuParameters parameters) { asked_.put(parameters); }
    /// What was asked for last; nothing: no change was. Any thread.
    [[nodiscard]] std::optional<sched::VcpuParameters> changed() const {
        std::uint32_t none = 0;
        return asked_.take(none);
    }

    /// The signal that a budget's end comes as. It is SIGRTMIN + 3, and what SIGRTMIN is glibc
    /// decides at run time.
    [[nodiscard]] static int signal_number() { return SIGRTMIN + 3; }

    /// Where the thread's own priority will stand: what confinement.h is to let it have again.
    [[nodiscard]] const void* own_rank() const { return &host_.own_rank; }
    /// How often the budget was spent and the thread slept for it.
    [[nodiscard]] std::uint64_t throttled() const { return host_.throttled; }
    /// CPU time that was charged beyond the end of the budget, before the timer could stop the
    /// thread. The host, interrupts, or a long system call of its own took it. Any thread may ask.
    [[nodiscard]] Nanoseconds beyond() const {
        return Nanoseconds{host_.beyond_ns.load(std::memory_order_relaxed)};
    }
    /// What others have done to the signal or the timer; empty: nothing. Any thread.
    [[nodiscard]] std::string_view tampering() const;
    /// CPU time charged so far.
    [[nodiscard]] Nanoseconds charged() const { return shell_.account().server().consumed(); }

  private:
    /// What the shell asks of the system.
    struct Host {
        [[nodiscard]] sched::BudgetReading read();
        [[nodiscard]] Nanoseconds cpu();
        void set_timer(const sched::BudgetEffect& effect);
        void sleep_until(Instant t);
        void step_back(bool back) const;

        timer_t timer{};
        sched_param own_rank{};  // priority 0: none
        std::uint64_t throttled = 0;
        Nanoseconds budget{};
        Nanoseconds cpu_read{};   // as of the last reading
        Nanoseconds cpu_limit{};  // when the timer's budget ends; 0: it is off
        std::atomic<std::int64_t> beyond_ns{0};
        SignsOfLife* life = nullptr;
        VcpuId vcpu = kNoVcpu;
    };
    static void on_timer(int, siginfo_t*, void*);
    void take_change() {
        if (const auto parameters = asked_.take(asked_seen_)) [[unlikely]]
            shell_.change(*parameters);
    }

    Host host_;
    sched::BudgetShell<Host> shell_{host_};
    ParametersMail asked_;
    std::uint32_t asked_seen_ = 0;
    bool running_ = false;
    static thread_local BudgetKeeper* mine_;
};

}  // namespace qduino::board::linux
