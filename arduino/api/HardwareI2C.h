// ArduinoCore-API's name of Wire.h.
#pragma once

#include "arduino/Wire.h"
