// The AVR's registers, as far as this board has what stands behind them: the ports of the Mega's
// pins (core/port_registers.h) and SREG. Timers, converters and the like have none: their names do
// not exist, so a sketch that writes them does not compile.
#pragma once

#ifdef __cplusplus
#include "arduino/Arduino.h"
#else
#include "arduino/core/board_pins.h"
#endif
