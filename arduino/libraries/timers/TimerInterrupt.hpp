// TimerInterrupt.h, as a sketch's further files name it.
#pragma once

#include "arduino/libraries/timers/TimerInterrupt.h"
