// One VCPU on a core: what it waits for, and, for an I/O VCPU, the work it was given.
//
//              ┌─ sleep_until(t) ─► sleeping ── t ─────────────┐
//   ready ─────┼─ no work left ───► idle ────── work came ─────┼─► ready
//              ├─ lock is taken ──► waiting ─── handed over ───┘
//              └─ entry returned ─► finished
#pragma once

#include <atomic>
#include <cstdint>

#include "base/time.h"
#include "board/board.h"
#include "board/handler_times.h"
#include "board/metal/computer/spin_lock.h"
#include "board/metal/core/context.h"
#include "channel/ring_buffer.h"
#include "sched/core_scheduler.h"
#include "sched/counted_turns.h"

namespace qduino::board::metal {

/// A handler to call for what came at `came`.
struct Work {
    EdgeHandler handler = nullptr;
    void* context = nullptr;
    Instant came{};
    bool after_stop = false;  ///< a device's bottom half: called also when the sketch has ended
};

/// Work from any core, in the order in which it came.
class WorkQueue {
  public:
    /// False when it is full.
    bool try_push(const Work& work) {
        const SpinGuard held(lock_);
        return ring_.try_push(work);
    }
    bool try_pop(Work& work) { return ring_.try_pop(work); }  ///< its I/O VCPU alone
    [[nodiscard]] bool empty() const { return ring_.size() == 0; }

  private:
    SpinLock lock_;  // between those that push
    channel::RingBuffer<Work, 256> ring_;
};

enum class ThreadState : std::uint8_t { unused, ready, sleeping, idle, waiting, finished };

struct Thread {
    Context context;
    VcpuSpec spec;
    ThreadState state = ThreadState::unused;  ///< its core's alone
    sched::CountedTurns turns;                ///< likewise: those it does not pay for
    std::atomic<std::uint32_t> paid{0};       ///< and so many that it paid for
    Instant wake = kForever;                  ///< sleeping: until then
    Nanoseconds slept{};

    // Under the lock of Locks, for all cores:
    const LockWord* waits_for = nullptr;
    sched::Rank rank;       ///< its own, or that of its highest waiter
    sched::Rank inherited;  ///< of its highest waiter; Rank{}: none

    // An I/O VCPU's:
    std::atomic<bool> serving{false};  ///< takes work
    WorkQueue queue;
    Instant came = kForever;  ///< when what it serves now was given to it
    HandlerTimes times;
    std::atomic<std::uint64_t> lost{0};  ///< handlers that found the queue full
    /// What change_io() gave it last. Under change_lock.
    sched::VcpuParameters change{};
    SpinLock change_lock;
};

}  // namespace qduino::board::metal
