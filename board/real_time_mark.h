// What a thread is, for the guard of debug builds: a real-time loop that has begun, or not.
//
// House rule 6: real-time loops allocate nothing and lock nothing after start. A debug build of a program on the Linux board
// holds them to it: linux/real_time_guard.cpp, linked into it, stands before malloc, free, operator new, pthread_mutex_lock and
// their kin, looks at this mark, and aborts with the loop's number, what it called, and from where. The abort goes
// through the safe states, as every death does.
//
//   setup()            void loop(2, 1, 8, 0) { … }        the board stops
//   ─ may allocate ─►│◄─────── must not ───────────►│─ may ─►
//
// Real-time, and held to the rule, is every loop that declares a budget, and every interrupt handler (I/O VCPU), whether the
// system granted SCHED_FIFO or not: what is wrong on the machine that has it is wrong on the desk of who writes the sketch.
// The classic `void loop()` is not: it stands for an Arduino, whose sketches use String as they like. A sketch that wants
// String in a real-time loop has it in `void loop()` and hands the bytes over in a RingBuffer. A Mutex of the sketch's
// is no lock in this sense: its wait is bounded (board.h).
//
// In a release build nothing looks at the mark, and it costs two stores in the life of a loop.
#pragma once

#include "board/types.h"

namespace qduino::board {

struct RealTimeMark {
    VcpuId loop = kNoVcpu;  ///< the real-time VCPU that this thread is at work for; kNoVcpu: none
    int allowed = 0;        ///< nested AllowAllocation
};
inline constinit thread_local RealTimeMark real_time_mark;

/// The calling thread is real-time VCPU `loop` while this lives; kNoVcpu: it is not real-time. A board's.
class RealTimeSection {
  public:
    explicit RealTimeSection(VcpuId loop) : before_(real_time_mark) { real_time_mark = {loop, 0}; }
    ~RealTimeSection() { real_time_mark = before_; }
    RealTimeSection(const RealTimeSection&) = delete;
    RealTimeSection& operator=(const RealTimeSection&) = delete;

  private:
    RealTimeMark before_;
};

/// An exception, for a scope, that says why it is one. Not around a wait: in the simulator all loops share one thread.
class AllowAllocation {
  public:
    /// `why` is for who reads the code.
    explicit AllowAllocation([[maybe_unused]] const char* why) { ++real_time_mark.allowed; }
    ~AllowAllocation() { --real_time_mark.allowed; }
    AllowAllocation(const AllowAllocation&) = delete;
    AllowAllocation& operator=(const AllowAllocation&) = delete;
};

}  // namespace qduino::board
