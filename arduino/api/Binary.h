// ArduinoCore-API's name of binary.h.
#pragma once

#include "arduino/binary.h"
