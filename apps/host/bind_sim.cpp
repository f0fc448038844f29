#include "apps/host/bind_sim.h"

#include "runtime/bind.h"

QDUINO_BIND_BOARD(board::sim::SimBoard);
