// One core: sched::CoreScheduler decides which thread runs, this class makes it so.
//
//   alarm, device, call, switch ──► enter(): what came? ──► mail, sleepers ──► decide(now)
//                                                                                │ thread, until
//                                   the thread goes on ◄── alarm at `until` ◄────┘
//
// A core's scheduler and the states of its threads belong to that core, with its interrupts off. It
// takes no lock for them. Others leave a bit in its mail and call it:
//
//   core 1: work for I/O VCPU 33 ──► core 0's mail: bit 33 ──► interrupt ──► core 0 wakes it
//
// The first core has the host, too: what runs before the loops, between them and after. While the
// host runs on, no thread of that core does, and nobody is charged.
//
// It has more functions than other classes: a list for each kind of caller.
//
//   thread ░░░░│ kernel: what came, who goes on │░░░░ thread         ░ charged to the thread
//              └──────────── nobody's ──────────┘
//
// Invariants: one context runs; the alarm is set to the earliest instant at which another one
// could, or not at all where noTimer() said so; what the kernel and a device's top half take is
// charged to nobody, as it is in R. Turns to a loop that are in no R are charged to the loop, where
// others are on its core (sched/counted_turns.h).
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

#include "base/time.h"
#include "board/metal/computer/core_interrupts.h"
#include "board/metal/core/mail.h"
#include "board/metal/core/thread.h"
#include "sched/core_scheduler.h"

namespace qduino::board::metal {

/// What came to a core since the loops began: for the guarantee report.
struct CoreCounts {
    std::atomic<std::uint64_t> alarms{0}, devices{0};
    std::atomic<std::uint64_t> calls{0};                     ///< of other cores, and of itself
    std::atomic<std::uint64_t> ends{0};                      ///< of budgets
    std::atomic<Nanoseconds> worst_overrun{Nanoseconds{0}};  ///< charged beyond such a budget
    std::atomic<std::uint64_t> passes{0};                    ///< through the kernel
    std::atomic<Nanoseconds> kernel{Nanoseconds{0}};         ///< time that these took
};

class Core {
  public:
    // ---- set up ---------------------------------------------------------------------------------
    /// On the core itself, once. `host`: it is the first core, and its caller is the host.
    void open(int number, bool host);
    /// What interrupts of others are sent to. Before anybody calls it.
    void set_target(std::uint32_t target) { target_ = target; }
    /// Where the core begins when it is started.
    [[nodiscard]] std::uint64_t boot_stack_top() const {
        return reinterpret_cast<std::uint64_t>(idle_.stack.data() + idle_.stack.size());
    }
    /// By the host, before begin_threads(). `turn`: what a switch to it and the one back cost.
    /// False when the scheduler's table refuses it.
    [[nodiscard]] bool add(Thread& thread, Nanoseconds turn, Instant now);
    /// By the host: from the next interrupt on, the threads that were added run.
    void begin_threads();

    // ---- the way in: entry.S of the architecture ------------------------------------------------
    /// Takes up what came, and returns the frame to go on with.
    Frame* enter(const Frame& frame);

    // ---- the running thread, with interrupts off ------------------------------------------------
    void sleep_until(Instant t) { give_up(ThreadState::sleeping, t); }
    void wait_for_work() { give_up(ThreadState::idle, kForever); }
    void wait_for_lock();
    [[noreturn]] void finish();
    /// Somebody may have to run in its place.
    static void look_up() { enter_by_itself(); }
    /// It begins the release that was due at `nominal`.
    void release(Instant nominal);
    /// CPU time that it has consumed.
    [[nodiscard]] Nanoseconds cpu_time();

    // ---- the host, on the first core ------------------------------------------------------------
    /// Threads run until `until`, or until call_host().
    void let_threads_run(Instant until);

    // ---- from any core --------------------------------------------------------------------------
    /// Something was left in its mail: it looks there soon.
    void call();
    [[nodiscard]] Mail& mail() { return mail_; }
    void call_host();
    void allow_alarms(bool allowed) { alarms_allowed_.store(allowed); }

    [[nodiscard]] bool alarms_allowed() const { return alarms_allowed_.load(); }
    [[nodiscard]] int number() const { return number_; }
    [[nodiscard]] std::uint32_t target() const { return target_; }
    /// Null: the host runs, or nobody.
    [[nodiscard]] Thread* running() const { return running_; }
    [[nodiscard]] const CoreCounts& counts() const { return counts_; }
    /// CPU time that a thread of this core was charged. While no thread of it runs.
    [[nodiscard]] Nanoseconds charged(const Thread& thread) const {
        return scheduler_.consumed(thread.spec.id);
    }

  private:
    struct Host {
        bool exists = false, runs = false;
        Instant until = kForever;  // its next turn
        Instant since = kEpoch;    // of this turn
        Context context;
    };
    struct Idle {
        Context context;
        alignas(16) std::array<std::uint8_t, 4096> stack{};
    };

    void give_up(ThreadState state, Instant wake);
    [[nodiscard]] bool runs_threads() const {
        return threads_began_.load(std::memory_order_acquire) && !host_.runs;
    }
    void charge(Instant came);
    void serve(const Frame& frame, Instant now);
    Context& choose(Instant came);
    void go_on(const sched::Decision& decision, Instant now, Instant next_wake);
    void count_pass(Nanoseconds length);
    void open_mail(Instant now);
    [[nodiscard]] Instant wake_sleepers(Instant now);
    void wake(Thread& thread, Instant now);
    void pay(Thread& thread, Instant now);
    [[nodiscard]] bool host_is_due(Instant now);
    void turn_to(Context& next, Thread* thread);

    int number_ = 0;
    std::uint32_t target_ = 0;
    std::atomic<bool> threads_began_{false}, alarms_allowed_{true};
    bool inside_ = false;  // enter() is at work
    Processor processor_;
    sched::CoreScheduler scheduler_;
    std::array<Thread*, kVcpuLimit> threads_{};
    std::size_t thread_count_ = 0;
    Nanoseconds turn_{};
    Context* current_ = nullptr;
    Thread* running_ = nullptr;  // current_, where that is a thread
    Instant until_ = kForever;   // of the last decision
    Mail mail_;
    CoreCounts counts_;
    Host host_;
    Idle idle_;
};

/// The calling core. Hold it only while interrupts are off, or on a thread, which never moves.
inline Core& this_core() { return *static_cast<Core*>(core_object()); }

}  // namespace qduino::board::metal
