// Programs on the Linux board: they link qduino_bind_linux, and call this before Runtime::begin().
//
//   auto board = LinuxBoard::open(config);
//   runtime::Runtime runtime(**board);
//   port::bind(&runtime);
//   auto begun = runtime.begin(runtime::sketch_table());
//   runtime.run(…);
#pragma once

#include "board/linux/linux_board.h"
#include "runtime/runtime.h"

namespace qduino::port {

/// Sends the calls of sketches and libraries to `runtime` from now on; null: nowhere. The runtime outlives its binding.
void bind(runtime::Runtime<board::linux::LinuxBoard>* runtime);

}  // namespace qduino::port
