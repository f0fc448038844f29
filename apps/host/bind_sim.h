// Programs on the simulator: they link qduino_bind_sim, and call this before Runtime::begin().
//
//   SimBoard board(config, peripherals);
//   runtime::Runtime runtime(board);
//   port::bind(&runtime);
//   auto begun = runtime.begin(runtime::sketch_table());
//   runtime.run(…);
#pragma once

#include "board/sim/sim_board.h"
#include "runtime/runtime.h"

namespace qduino::port {

/// Sends the calls of sketches and libraries to `runtime` from now on; null: nowhere. The runtime outlives its binding.
void bind(runtime::Runtime<board::sim::SimBoard>* runtime);

}  // namespace qduino::port
