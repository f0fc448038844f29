// ArduinoCore-API's name of USBAPI.h.
#pragma once

#include "arduino/libraries/hid/USBAPI.h"
