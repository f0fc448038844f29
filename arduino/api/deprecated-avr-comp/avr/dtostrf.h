// ArduinoCore-API's name of the header with dtostrf().
#pragma once

#include "arduino/core/libc_of_avr.h"
