// Marks a thread that runs a real-time loop, for the guard of debug builds.
//
// House rule 6: real-time loops allocate nothing and lock nothing after start. A review cannot see
// every call of a library, so a debug build holds the loops to the rule.
// linux/kernel/real_time_guard.cpp replaces malloc, free, operator new, pthread_mutex_lock and
// their kin. Each looks at this mark, and aborts with the loop's number, the name of the call, and
// a stack. The abort forces the safe states, as every death does.
//
//   setup()            void loop(2, 1, 8, 0) { … }        the board stops
//   ─ may allocate ─►│◄─────── must not ───────────►│─ may ─►
//
// The rule holds for every loop that declares a budget and for every interrupt handler (I/O VCPU).
// It holds without SCHED_FIFO, too: the author of a sketch then meets the error on a desk without
// real-time priorities. The classic `void loop()` is exempt: it stands for an Arduino, whose
// sketches use String as they like. A sketch that wants String in a real-time loop builds it in
// `void loop()` and hands the bytes over in a RingBuffer. A sketch's Mutex does not count as a lock
// here: its wait is bounded (board.h).
//
// In a release build nothing looks at the mark; it costs two stores in the life of a loop.
#pragma once

#include "board/types.h"

namespace qduino::board {

struct RealTimeMark {
    VcpuId loop = kNoVcpu;  ///< the real-time VCPU that this thread is at work for; kNoVcpu: none
    int allowed = 0;        ///< nested AllowAllocation
};
inline constinit thread_local RealTimeMark real_time_mark;

/// The calling thread is real-time VCPU `loop` while this lives; kNoVcpu: it is not real-time. For
/// boards.
class RealTimeSection {
  public:
    explicit RealTimeSection(VcpuId loop) : before_(real_time_mark) { real_time_mark = {loop, 0}; }
    ~RealTimeSection() { real_time_mark = before_; }
    RealTimeSection(const RealTimeSection&) = delete;
    RealTimeSection& operator=(const RealTimeSection&) = delete;

  private:
    RealTimeMark before_;
};

/// Exempts a scope from the rule, with a reason. Not around a wait: in the simulator all loops
/// share one thread.
class AllowAllocation {
  public:
    /// `why` is for the reader of the code.
    explicit AllowAllocation([[maybe_unused]] const char* why) { ++real_time_mark.allowed; }
    ~AllowAllocation() { --real_time_mark.allowed; }
    AllowAllocation(const AllowAllocation&) = delete;
    AllowAllocation& operator=(const AllowAllocation&) = delete;
};

}  // namespace qduino::board
