#include "BoardPins.h"

#include "pins_arduino.h"

#if NUM_DIGITAL_PINS < 20
#error "this board has too few pins"
#endif

uint8_t defaultClockPin() { return SCK; }
int pinsOfBoard() { return NUM_DIGITAL_PINS + analogInputToDigitalPin(3); }
