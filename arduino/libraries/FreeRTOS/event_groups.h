// FreeRTOS' event_groups.h behind Arduino_FreeRTOS.h. A library may have a header of
// this name, too: without FreeRTOS before it, that one is meant, as on an AVR.
#pragma once

#if !defined(QDUINO_FREERTOS)
#include_next <event_groups.h>
#else
#include "arduino/libraries/FreeRTOS/freertos/event_groups.h"
#endif
