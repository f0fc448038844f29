// ISR_Timer.h, as a sketch's further files name it.
#pragma once

#include "arduino/ISR_Timer.h"
