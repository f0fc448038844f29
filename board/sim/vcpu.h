// One simulated VCPU: its fiber, what it waits for, and, for an I/O VCPU, the work it was given.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>

#include "base/time.h"
#include "board/board.h"
#include "board/handler_times.h"
#include "board/sim/fiber.h"
#include "board/sim/spin.h"
#include "board/types.h"
#include "sched/core_scheduler.h"
#include "sched/counted_turns.h"

namespace qduino::board::sim {

class EventLoop;
class SimCore;

struct Vcpu;

/// A handler to call, or CPU time to take, or both, in this order of arrival.
struct Work {
    EdgeHandler handler = nullptr;
    void* context = nullptr;
    Nanoseconds cost{};
    Instant came{};         ///< when it was given
    Vcpu* waits = nullptr;  ///< a loop that sleeps until this is done, and on whose behalf it is
};

/// What an I/O VCPU has to do, first come first served. Bounded, like a device's own queue.
class WorkQueue {
  public:
    static constexpr std::size_t kCapacity = 256;

    /// False, and nothing changed, when full.
    [[nodiscard]] bool try_push(const Work& work) {
        if (pushed_ - popped_ == kCapacity) return false;
        items_[pushed_++ % kCapacity] = work;
        return true;
    }
    [[nodiscard]] bool empty() const { return pushed_ == popped_; }
    /// Contract: not empty.
    Work pop() { return items_[popped_++ % kCapacity]; }

  private:
    std::array<Work, kCapacity> items_{};
    std::uint64_t pushed_ = 0;
    std::uint64_t popped_ = 0;
};

enum class VcpuState : std::uint8_t {
    ready,     ///< wants the CPU: has `work_left`, spins until `spin_until`, or its code goes on
    sleeping,  ///< until `wake`; kForever: until it is given work
    finished,  ///< its entry returned
};

struct Vcpu {
    VcpuSpec spec;
    EventLoop* loop = nullptr;
    SimCore* core = nullptr;
    std::unique_ptr<Fiber> fiber;
    VcpuState state = VcpuState::sleeping;
    Instant wake = kEpoch;
    bool spinning = false;                ///< waits in EventLoop::spin_for()
    Spin spin;                            ///< the last that it was in
    Nanoseconds slept{};                  ///< in sleeps that it asked for, and waits for a bus
    std::int64_t sleeps = 0;              ///< so many of them
    Nanoseconds client_period{};          ///< of the client of a waking I/O VCPU; 0: usual
    Nanoseconds work_left{};              ///< CPU time to be consumed before its code goes on
    Instant spin_until = kEpoch;          ///< its code does not go on before
    Instant body_ended = Instant::min();  ///< when its body last returned
    const LockWord* waits_for = nullptr;  ///< a lock that another VCPU holds
    bool handed_lock = false;             ///< woken by unlock(): no release of a loop
    sched::CountedTurns turns;            ///< a loop: those that it does not pay for
    sched::Rank rank;                     ///< its own, or what it inherits
    sched::Rank inherited;                ///< the highest of those that wait for it
    std::uint32_t polls = 0;              ///< of the time or of a pin since it last let time pass
    bool throttled = false;               ///< ready, without budget; for the trace
    bool has_fault = false;               ///< SimConfig::loop_faults names it
    std::unique_ptr<WorkQueue> queue;     ///< I/O VCPUs that serve handlers
    Instant came = kForever;              ///< when what it serves now was given to it
    HandlerTimes times;                   ///< of what came from edges and interrupts

    /// The code of this VCPU goes on at the earliest, if it has the CPU from `now` on.
    [[nodiscard]] Instant done_at(Instant now) const {
        if (work_left > kForever - now) return kForever;
        return now + work_left > spin_until ? now + work_left : spin_until;
    }
};

}  // namespace qduino::board::sim
