/* The AVR's registers (avr/io.h), by the name of the header that has those of all its kinds. */
#pragma once

#include "arduino/avr/io.h"
