// Runs the sketch that is linked in on the Linux board, until it stops itself or the time is over.
#pragma once

#include "base/time.h"
#include "board/linux/kernel/linux_config.h"

namespace qduino::emulated {

/// Prints the guarantee when the sketch ends, as text and as one line "guarantee: {json}". Returns
/// 0 when the sketch stopped by itself, 1 when it did not within `longest`, 2 when it could not be
/// started.
int run_sketch(board::linux::LinuxConfig config, Nanoseconds longest);

}  // namespace qduino::emulated
