// The kind of UART that serial lines have here. Both have the same functions.
#pragma once

#ifdef __aarch64__
#include "board/metal/driver/pl011.h"
#else
#include "board/metal/driver/uart_16550.h"
#endif

namespace qduino::board::metal {

#ifdef __aarch64__
using Uart = Pl011;
#else
using Uart = Uart16550;
#endif

}  // namespace qduino::board::metal
