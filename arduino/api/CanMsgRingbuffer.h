// ArduinoCore-API's name of CanMsgRingbuffer.h.
#pragma once

#include "arduino/libraries/CAN/CanMsgRingbuffer.h"
