// Semaphores and mutexes of FreeRTOS (Arduino_FreeRTOS.h).
#pragma once

#include "arduino/libraries/FreeRTOS/Arduino_FreeRTOS.h"
#include "arduino/libraries/FreeRTOS/freertos/objects.h"

using SemaphoreHandle_t = qduino::arduino::freertos::Semaphore*;

// They take memory: for setup().
inline SemaphoreHandle_t xSemaphoreCreateBinary() {
    using qduino::arduino::freertos::Semaphore;
    return new Semaphore(Semaphore::Kind::counting, 1, 0);
}
inline SemaphoreHandle_t xSemaphoreCreateCounting(UBaseType_t most, UBaseType_t count) {
    using qduino::arduino::freertos::Semaphore;
    return new Semaphore(Semaphore::Kind::counting, static_cast<std::uint32_t>(most),
                         static_cast<std::uint32_t>(count));
}
inline SemaphoreHandle_t xSemaphoreCreateMutex() {
    using qduino::arduino::freertos::Semaphore;
    return new Semaphore(Semaphore::Kind::mutex, 1, 1);
}
inline SemaphoreHandle_t xSemaphoreCreateRecursiveMutex() {
    using qduino::arduino::freertos::Semaphore;
    return new Semaphore(Semaphore::Kind::recursive, 1, 1);
}
#define vSemaphoreCreateBinary(handle)       \
    do {                                     \
        (handle) = xSemaphoreCreateBinary(); \
        xSemaphoreGive(handle);              \
    } while (0)
inline void vSemaphoreDelete(SemaphoreHandle_t semaphore) { delete semaphore; }

inline BaseType_t xSemaphoreTake(SemaphoreHandle_t semaphore, TickType_t ticks) {
    return semaphore && semaphore->take(ticks) ? pdTRUE : pdFALSE;
}
inline BaseType_t xSemaphoreGive(SemaphoreHandle_t semaphore) {
    return semaphore && semaphore->give() ? pdTRUE : pdFALSE;
}
inline BaseType_t xSemaphoreTakeRecursive(SemaphoreHandle_t mutex, TickType_t ticks) {
    return xSemaphoreTake(mutex, ticks);
}
inline BaseType_t xSemaphoreGiveRecursive(SemaphoreHandle_t mutex) { return xSemaphoreGive(mutex); }
inline UBaseType_t uxSemaphoreGetCount(SemaphoreHandle_t semaphore) { return semaphore->count(); }

// From handlers, which do not wait.
inline BaseType_t xSemaphoreGiveFromISR(SemaphoreHandle_t semaphore, BaseType_t* woken = nullptr) {
    if (woken) *woken = pdFALSE;
    return xSemaphoreGive(semaphore);
}
inline BaseType_t xSemaphoreTakeFromISR(SemaphoreHandle_t semaphore, BaseType_t* woken = nullptr) {
    if (woken) *woken = pdFALSE;
    return xSemaphoreTake(semaphore, 0);
}
