// ArduinoCore-API's name of RingBuffer.h.
#pragma once

#include "arduino/RingBuffer.h"
