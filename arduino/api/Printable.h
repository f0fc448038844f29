// ArduinoCore-API's name of Printable.h.
#pragma once

#include "arduino/Printable.h"
