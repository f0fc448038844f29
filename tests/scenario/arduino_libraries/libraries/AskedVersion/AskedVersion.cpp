#if defined(ARDUINO) && ARDUINO >= 100
#include <Arduino.h>
#else
#include <WConstants.h>
#include <WProgram.h>
#endif
#include "AskedVersion.h"

unsigned long AskedVersion::now() { return millis(); }
