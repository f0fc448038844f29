/* The older name of util/twi.h. */
#pragma once

#include "arduino/util/twi.h"
