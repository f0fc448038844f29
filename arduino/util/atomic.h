// avr-libc's blocks that no interrupt handler enters. (avr-libc user manual, <util/atomic.h>.)
//
// A handler is a thread here: the block holds back those that have not begun, and does not stop one
// that runs on another core. What several loops share wants a Mutex or a Channel (QduinoMC.h).
#pragma once

#include <utility>

#include "arduino/avr/interrupt.h"

namespace qduino::arduino {
/// Holds handlers back until its end, which leaves them as `restored` says.
class AtomicBlock {
  public:
    explicit AtomicBlock(bool restored) : after_(restored ? static_cast<std::uint8_t>(SREG) : kHandlersRun) {
        cli();
    }
    ~AtomicBlock() { SREG = after_; }
    AtomicBlock(const AtomicBlock&) = delete;
    AtomicBlock& operator=(const AtomicBlock&) = delete;

    /// True once: the block's body runs so often.
    bool once() { return !std::exchange(entered_, true); }

  private:
    std::uint8_t after_;
    bool entered_ = false;
};
}  // namespace qduino::arduino

#define ATOMIC_RESTORESTATE true
#define ATOMIC_FORCEON false
// Each block has a name of its own, so that one may stand within another.
#define ATOMIC_BLOCK(restored) QDUINO_ATOMIC_BLOCK(restored, __COUNTER__)
#define QDUINO_ATOMIC_BLOCK(restored, n) QDUINO_ATOMIC_BLOCK_NAMED(restored, n)
#define QDUINO_ATOMIC_BLOCK_NAMED(restored, n) \
    for (::qduino::arduino::AtomicBlock qduino_atomic_##n{restored}; qduino_atomic_##n.once();)
