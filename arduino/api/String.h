// ArduinoCore-API's name of WString.h.
#pragma once

#include "arduino/WString.h"
