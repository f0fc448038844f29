// ArduinoCore-API's name of Server.h.
#pragma once

#include "arduino/libraries/network/Server.h"
