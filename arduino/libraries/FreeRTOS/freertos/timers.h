// Software timers of FreeRTOS (Arduino_FreeRTOS.h): functions that one task calls.
#pragma once

#include "arduino/libraries/FreeRTOS/Arduino_FreeRTOS.h"
#include "arduino/libraries/FreeRTOS/freertos/objects.h"

using TimerHandle_t = qduino::arduino::freertos::Timer*;
using TimerCallbackFunction_t = void (*)(TimerHandle_t);

/// In setup(). Null: there are 16, or no loop is free for the timers' task.
inline TimerHandle_t xTimerCreate(const char* name, TickType_t period, BaseType_t again, void* id,
                                  TimerCallbackFunction_t function) {
    return qduino::arduino::freertos::make_timer(name, period, again != pdFALSE, id, function);
}
inline BaseType_t xTimerStart(TimerHandle_t timer, TickType_t) {
    if (timer) timer->start();
    return timer ? pdPASS : pdFAIL;
}
inline BaseType_t xTimerReset(TimerHandle_t timer, TickType_t ticks) { return xTimerStart(timer, ticks); }
inline BaseType_t xTimerStop(TimerHandle_t timer, TickType_t) {
    if (timer) timer->stop();
    return timer ? pdPASS : pdFAIL;
}
inline BaseType_t xTimerChangePeriod(TimerHandle_t timer, TickType_t period, TickType_t) {
    if (!timer || period == 0) return pdFAIL;
    timer->set_period(period);
    return pdPASS;
}
/// It is stopped; its place stays taken.
inline BaseType_t xTimerDelete(TimerHandle_t timer, TickType_t ticks) { return xTimerStop(timer, ticks); }
inline BaseType_t xTimerIsTimerActive(TimerHandle_t timer) { return timer->runs() ? pdTRUE : pdFALSE; }
inline void* pvTimerGetTimerID(TimerHandle_t timer) { return timer->id(); }
inline void vTimerSetTimerID(TimerHandle_t timer, void* id) { timer->set_id(id); }
inline const char* pcTimerGetName(TimerHandle_t timer) { return timer->name(); }
inline TickType_t xTimerGetPeriod(TimerHandle_t timer) { return timer->period(); }
