// ArduinoCore-API's name of WCharacter.h.
#pragma once

#include "arduino/WCharacter.h"
