// ArduinoCore-API's name of an AVR's header.
#pragma once

#include "arduino/avr/interrupt.h"
