// ArduinoCore-API's name of libc_of_avr.h.
#pragma once

#include "arduino/core/libc_of_avr.h"
