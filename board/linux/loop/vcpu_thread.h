// One VCPU as a thread: made, pinned, given its priority, held at a gate until all are ready, run
// once, joined.
//
// It has more functions than other classes: it hands the calls of its thread's budget on, so that
// nobody else knows the keeper.
#pragma once

#include <pthread.h>
#include <sys/types.h>

#include <atomic>
#include <cstdint>
#include <optional>
#include <string_view>

#include "base/fixed_string.h"
#include "base/result.h"
#include "board/linux/computer/isolation.h"
#include "board/linux/kernel/confinement.h"
#include "board/linux/kernel/cycle_clock.h"
#include "board/linux/kernel/real_time_thread.h"
#include "board/linux/loop/budget_keeper.h"
#include "board/linux/loop/spin_allowance.h"
#include "board/linux/loop/timer_gravity.h"
#include "board/types.h"

namespace qduino::board::linux {

/// Threads wait here until all of them are ready. A futex: 0 shut, 1 open, 2 given up.
struct StartGate {
    std::atomic<std::uint32_t> state{0};
    std::atomic<std::uint32_t> ready{0};
};

/// Options of a VCPU's thread.
struct VcpuThreadOptions {
    int priority = 0;  ///< SCHED_FIFO; 0: do not ask
    std::size_t stack_bytes = std::size_t{1} << 20;
    bool enforce_budget = false;
    double spin_share = 1;  ///< of its core, for a loop that spins; 1: all of it (spin_allowance.h)
    std::optional<Confinement> confinement;  ///< of its system calls, once it runs
    const Isolation* isolation = nullptr;    ///< whose core it enters; null: none
    /// Is told of its sleeps for a spent budget, and of its end; null: nobody.
    SignsOfLife* life = nullptr;
    StartGate* gate = nullptr;  ///< outlives the thread
    /// Futex; counted up when the entry has returned.
    std::atomic<std::uint32_t>* returned = nullptr;
};

class VcpuThread {
  public:
    VcpuThread(const VcpuSpec& spec, const VcpuThreadOptions& options) : spec_(spec), options_(options) {}
    ~VcpuThread() { join(); }
    VcpuThread(const VcpuThread&) = delete;
    VcpuThread& operator=(const VcpuThread&) = delete;

    /// Makes the thread. It prepares itself and waits at the gate. Error: unavailable.
    Result<void> create();
    void join();

    /// As it was made.
    [[nodiscard]] const VcpuSpec& spec() const { return spec_; }
    /// Its budget and period as of now. Any thread.
    [[nodiscard]] sched::VcpuParameters parameters() const {
        return keeper_.changed().value_or(spec_.parameters());
    }
    /// Gives it another budget and period: an I/O VCPU's thread. From any one thread at a time.
    void change(sched::VcpuParameters parameters) { keeper_.change(parameters); }
    [[nodiscard]] bool returned() const { return finished_.load(std::memory_order_acquire); }
    /// It is ready, and waits for the gate to open, or has passed it.
    [[nodiscard]] bool at_gate() const { return at_gate_.load(std::memory_order_acquire); }
    /// Another thread of higher rank has its core: it may end on any other.
    void leave_core() const {
        if (created_ && !returned()) widen(thread_);
    }

    // Known once the thread is at the gate:
    [[nodiscard]] bool pinned() const { return pinned_; }
    [[nodiscard]] bool real_time() const { return real_time_; }
    [[nodiscard]] bool budget_kept() const { return budget_kept_; }
    [[nodiscard]] int priority() const { return real_time_ ? options_.priority : 0; }
    /// What the sketch has done to the timer of its budget; empty: nothing. Any thread.
    [[nodiscard]] std::string_view tampering() const { return keeper_.tampering(); }
    [[nodiscard]] const FixedString<160>& shortfall() const { return shortfall_; }

    /// Call before and after a wait of the calling thread: tells its budget. No effect without
    /// enforcement.
    void before_block() { keeper_.before_block(kForever); }
    void after_block() { keeper_.after_block(cycle_clock.now()); }
    /// The calling thread begins the release that was due at `nominal`: tells its budget.
    void begin_release(Instant nominal) {
        if (spec_.deferrable) keeper_.begin_release(nominal);
    }
    /// Call around the time in which the calling thread holds a lock (budget_keeper.h).
    void begin_hold() { keeper_.begin_hold(); }
    void end_hold() { keeper_.end_hold(); }

    /// How often its budget has ended.
    [[nodiscard]] std::int64_t throttled() const { return static_cast<std::int64_t>(keeper_.throttled()); }
    /// CPU time charged to it beyond its budget's end (budget_keeper.h). Any thread.
    [[nodiscard]] Nanoseconds beyond() const { return keeper_.beyond(); }

    /// Call before a spin until `t`: sleeps first, where the thread may not fill its core.
    void rest_before_spin(Instant t) {
        if (spin_.limited()) rest(t);
    }
    /// Sleeps until about `t`, perhaps a little less, so that the thread runs by then
    /// (timer_gravity.h). Tells its budget.
    void sleep_towards(Instant t);
    [[nodiscard]] bool rests() const { return spin_.limited(); }

    /// The calling thread was so late.
    void was_late(Nanoseconds lateness) {
        raise(worst_late_ns_, lateness);
        raise(worst_lately_ns_, lateness);
    }
    /// The calling thread's release ended late.
    void count_late() { late_.store(late() + 1, std::memory_order_relaxed); }
    [[nodiscard]] std::int64_t late() const { return late_.load(std::memory_order_relaxed); }
    /// At the worst since the last call. From one thread at a time.
    [[nodiscard]] Nanoseconds take_worst_lately() {
        return Nanoseconds{worst_lately_ns_.exchange(0, std::memory_order_relaxed)};
    }
    /// At the worst, so far. Any thread.
    [[nodiscard]] Nanoseconds worst_late() const {
        return Nanoseconds{worst_late_ns_.load(std::memory_order_relaxed)};
    }

    /// How long it has slept to known instants, so far. By itself.
    [[nodiscard]] Nanoseconds slept() const { return slept_; }
    /// In how many sleeps. By itself.
    [[nodiscard]] std::int64_t sleeps() const { return sleeps_; }
    /// The VCPU of the calling thread; kNoVcpu on any other thread.
    [[nodiscard]] static VcpuId current_id() { return current_ ? current_->spec_.id : kNoVcpu; }
    [[nodiscard]] static VcpuThread* current() { return current_; }
    /// The kernel's thread id. Known once the thread runs.
    [[nodiscard]] pid_t tid() const { return tid_; }

  private:
    /// The calling thread is the only one that raises it.
    static void raise(std::atomic<std::int64_t>& worst, Nanoseconds lateness) {
        if (lateness.count() > worst.load(std::memory_order_relaxed))
            worst.store(lateness.count(), std::memory_order_relaxed);
    }
    static void* main(void* self);
    void prepare();
    void become_confined() const;
    void rest(Instant t);
    Instant sleep(Instant now, Instant t);
    void add_shortfall(std::string_view text);

    VcpuSpec spec_;
    VcpuThreadOptions options_;
    pthread_t thread_{};
    pid_t tid_ = 0;
    bool created_ = false;
    bool pinned_ = false;
    bool real_time_ = false;
    bool budget_kept_ = false;
    BudgetKeeper keeper_;
    SpinAllowance spin_;
    TimerGravity gravity_;
    Nanoseconds slept_{};
    std::int64_t sleeps_ = 0;
    FixedString<160> shortfall_;
    std::atomic<bool> at_gate_{false};
    std::atomic<bool> finished_{false};
    std::atomic<std::int64_t> worst_late_ns_{0};
    std::atomic<std::int64_t> worst_lately_ns_{0};
    std::atomic<std::int64_t> late_{0};
    static constinit thread_local VcpuThread* current_;
};

}  // namespace qduino::board::linux
