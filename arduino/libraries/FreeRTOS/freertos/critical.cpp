// taskENTER_CRITICAL() … taskEXIT_CRITICAL(): one lock for the whole program. Apart from the rest
// of FreeRTOS: admission knows of this lock exactly when a sketch, or a library of it, uses it.
#include "arduino/core/lock.h"
#include "arduino/libraries/FreeRTOS/Arduino_FreeRTOS.h"

namespace {

qduino::arduino::Lock critical{"taskENTER_CRITICAL()", qduino::runtime::Unsaid::unknown};

}  // namespace

void taskENTER_CRITICAL() { critical.lock(); }
void taskEXIT_CRITICAL() { critical.unlock(); }
