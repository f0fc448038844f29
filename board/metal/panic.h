// The end of a computer that cannot go on: a broken contract, an exception of the processor, no
// memory.
//
//   safe levels ──► the other cores stop ──► safe levels again ──► words ──► off
//
// The pins come first: what is said may take milliseconds, or never end. They come twice, because a
// core that was about to write one does so before it stops.
#pragma once

#include <string_view>

#include "board/metal/core/context.h"

namespace qduino::board::metal {

[[noreturn]] void panic(std::string_view why);
/// An exception came; or, from a core that panics, the order to stop.
[[noreturn]] void panic(const Frame& frame);

/// Words about the sketch: to Linux, where that has the rest of the computer, or to an emulator
/// (tell_emulator()). False: there is neither. Takes no lock.
bool tell_beside(std::string_view text);
/// The same; where there is neither, over the serial line at its own pace, behind what waits there.
/// Not while loops run: a line of text takes milliseconds.
void report(std::string_view text);

/// Turns the computer off; 0: all is well. On x86-64 QEMU's isa-debug-exit ends the emulator with
/// 2·status + 1; Bochs notes the status, and ends by its own port; on aarch64 an emulator ends with
/// the status. Elsewhere the computer halts. A core that Linux gave up halts, and Linux is told the
/// status.
[[noreturn]] void turn_off(int status);

}  // namespace qduino::board::metal
