// Where newer cores of Arduino keep it; some libraries include it by this path.
#pragma once

#include "arduino/core/program_memory.h"
