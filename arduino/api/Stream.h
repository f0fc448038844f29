// ArduinoCore-API's name of Stream.h.
#pragma once

#include "arduino/Stream.h"
