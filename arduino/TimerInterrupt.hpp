// TimerInterrupt.h, as a sketch's further files name it.
#pragma once

#include "arduino/TimerInterrupt.h"
