// The name that IRremote.hpp had before the library's version 3.3.
#pragma once

#include "arduino/libraries/IRremote/IRremote.hpp"
