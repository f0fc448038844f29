// ArduinoCore-API's name of Client.h.
#pragma once

#include "arduino/libraries/network/Client.h"
