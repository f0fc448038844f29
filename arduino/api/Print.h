// ArduinoCore-API's name of Print.h.
#pragma once

#include "arduino/Print.h"
