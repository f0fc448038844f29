// The WiFi library keeps its client in a header of its own.
#pragma once

#include "arduino/libraries/network/WiFi.h"
