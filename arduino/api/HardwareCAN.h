// ArduinoCore-API's name of HardwareCAN.h.
#pragma once

#include "arduino/libraries/CAN/HardwareCAN.h"
