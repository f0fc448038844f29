#include "apps/host/bind_linux.h"

#include "runtime/bind.h"

QDUINO_BIND_BOARD(board::linux::LinuxBoard);
