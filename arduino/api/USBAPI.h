// ArduinoCore-API's name of USBAPI.h.
#pragma once

#include "arduino/USBAPI.h"
