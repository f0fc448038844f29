// ArduinoCore-API's name of CanMsg.h.
#pragma once

#include "arduino/libraries/CAN/CanMsg.h"
