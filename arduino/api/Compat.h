// ArduinoCore-API's name of Arduino.h.
#pragma once

#include "arduino/Arduino.h"
