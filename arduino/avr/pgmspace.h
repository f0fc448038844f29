// The AVR's header for data in flash, for sketches and libraries that include it by name.
#pragma once

#include "arduino/core/program_memory.h"
