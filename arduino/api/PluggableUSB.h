// ArduinoCore-API's name of PluggableUSB.h.
#pragma once

#include "arduino/libraries/hid/PluggableUSB.h"
