// Finds code that jumps to itself for ever: `for (;;) continue;`.
//
// The compiler makes one instruction of it, in a block that is not counted (spin_watch.h). The host
// would stand in it, deaf to everything but a signal. So a timer counts the CPU time of this
// process and sends SIGVTALRM every 10 ms of it; a process that waits in the kernel gets none. The
// handler looks at the instruction that it interrupted:
//
//   jmp .      the code does nothing and never will: SpinWatch::never_go_on(), on the code's own
//              stack. No function of any library is interrupted there, so all may be called
//   else       nothing
//
// Code outside of the sketch that spins is neither counted nor a jump to itself. Where neither
// virtual time nor the count of blocks has moved for kHopeless ticks, `hopeless` is called.
#pragma once

#include <cstdint>

#include "board/sim/event_loop.h"

namespace qduino::board::sim {

/// While it lives, SIGVTALRM is its own. At most one; on the thread that runs the board.
class EndlessJumps {
  public:
    /// 20 s of CPU time.
    static constexpr int kHopeless = 2000;

    /// `hopeless(place)` runs in a signal's handler, wherever the code was: it may not return.
    /// Null: nothing is done then. `loop` outlives this.
    EndlessJumps(EventLoop& loop, void (*hopeless)(const void* place));
    ~EndlessJumps();
    EndlessJumps(const EndlessJumps&) = delete;
    EndlessJumps& operator=(const EndlessJumps&) = delete;
};

/// The instruction at `code` jumps to itself, perhaps over instructions that do nothing. Nothing on
/// processors other than x86-64 and aarch64.
[[nodiscard]] bool jumps_to_itself(const std::uint8_t* code);

}  // namespace qduino::board::sim
