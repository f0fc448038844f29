// The threads of the VCPUs: made, held at a gate until all are ready, run, joined.
//
//   add() ► thread ▒▒▒│           ▒ prepares itself: core, priority, stack, budget
//   add() ► thread ▒▒▒│████···██
//   add() ► thread ▒▒ │██··███··  … request_stop() … entries return … wait_until() says so
//                     go()            wait_until_ready() before it
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "base/result.h"
#include "board/linux/kernel/linux_config.h"
#include "board/linux/loop/vcpu_thread.h"

namespace qduino::board::linux {

/// On a core that several VCPUs share, enforcing a smaller budget costs more than the budget.
inline constexpr Nanoseconds kShortestSharedBudget = 100us;

/// Error: a spec is malformed, or asks for what this board cannot enforce; which one and why.
Result<void> check_specs(std::span<const VcpuSpec> specs, const LinuxConfig& config, int core_count);

/// SCHED_FIFO priority of `spec` among `all`: rate-monotonic; of equal periods on one core the
/// lower id first, so a bottom half comes behind the loops of its client's period. Where the
/// computer has more ranks than priorities, each core has an order of its own (admission then
/// trusts none between cores); where a core has more, the last ones share the lowest. 0: none is
/// asked for.
int priority_of(const VcpuSpec& spec, std::span<const VcpuSpec> all, const LinuxConfig& config);

class Crew {
  public:
    using Threads = std::vector<std::unique_ptr<VcpuThread>>;

    ~Crew() { join(); }

    /// Makes a thread, which waits at the gate. After an error all are gone again. Setup-time.
    /// Error: unavailable.
    Result<void> add(const VcpuSpec& spec, VcpuThreadOptions options);
    /// Waits until all are at the gate, for `patience` at most, and for a second once a stop was
    /// requested. Null, or a thread that has not come: somebody of higher rank has its core. Then
    /// all are gone again.
    [[nodiscard]] std::optional<VcpuSpec> wait_until_ready(Nanoseconds patience);
    /// Lets them go at once.
    void go() { open_gate(1); }
    /// Returns true when a stop was requested and all entries have returned; false at `until`.
    /// Calls `when_woken` after each call of wake().
    bool wait_until(Instant until, const std::function<void()>& when_woken);
    /// Has the thread in wait_until(), or that comes there next, do what it is to do when woken.
    /// Real-time safe.
    void wake();
    /// Async-signal-safe.
    void request_stop();
    [[nodiscard]] const std::atomic<bool>& stop() const { return stop_; }
    /// All entries have returned.
    [[nodiscard]] bool all_returned() const;
    /// Waits for the threads to end, and forgets them.
    void join() { threads_.clear(); }

    [[nodiscard]] const Threads& threads() const { return threads_; }

  private:
    void open_gate(std::uint32_t state);
    void send_home();

    std::atomic<bool> stop_{false};
    // futex of wait_until(): an entry has returned, or a stop or wake() was requested.
    std::atomic<std::uint32_t> returned_{0};
    std::atomic<bool> woken_{false};
    StartGate gate_;
    Threads threads_;  // before what they use goes: joined first
};

}  // namespace qduino::board::linux
