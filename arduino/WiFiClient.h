// The WiFi library keeps its client in a header of its own.
#pragma once

#include "arduino/WiFi.h"
