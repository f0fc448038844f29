// FastLED's arithmetic of eight and sixteen bits, under the name that its examples include.
#pragma once

#include "arduino/libraries/FastLED/FastLED.h"
