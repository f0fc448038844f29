// The Ethernet library keeps its UDP in a header of its own.
#pragma once

#include "arduino/libraries/network/Ethernet.h"
