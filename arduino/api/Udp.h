// ArduinoCore-API's name of Udp.h.
#pragma once

#include "arduino/libraries/network/Udp.h"
