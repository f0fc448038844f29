/* Arduino.h's name before Arduino 1.0. */
#pragma once

#include "arduino/Arduino.h"
