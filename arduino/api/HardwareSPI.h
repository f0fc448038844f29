// ArduinoCore-API's name of SPI.h.
#pragma once

#include "arduino/SPI.h"
