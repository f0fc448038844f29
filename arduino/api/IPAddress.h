// ArduinoCore-API's name of IPAddress.h.
#pragma once

#include "arduino/libraries/network/IPAddress.h"
