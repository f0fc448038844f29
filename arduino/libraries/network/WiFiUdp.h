// The WiFi library keeps its UDP in a header of its own.
#pragma once

#include "arduino/libraries/network/WiFi.h"
