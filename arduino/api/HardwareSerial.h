// ArduinoCore-API's name of HardwareSerial.h.
#pragma once

#include "arduino/HardwareSerial.h"
