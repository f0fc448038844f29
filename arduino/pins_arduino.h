// The board's pins, for libraries that include them by this name.
#pragma once

#include "arduino/Arduino.h"
