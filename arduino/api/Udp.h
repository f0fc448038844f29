// ArduinoCore-API's name of Udp.h.
#pragma once

#include "arduino/Udp.h"
