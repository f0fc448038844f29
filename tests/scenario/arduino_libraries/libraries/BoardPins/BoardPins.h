// A display's driver: its pins come from the board's own list.
#pragma once
#include <stdint.h>

uint8_t defaultClockPin();
int pinsOfBoard();
