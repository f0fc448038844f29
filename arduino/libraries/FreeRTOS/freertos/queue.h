// Queues of FreeRTOS (Arduino_FreeRTOS.h).
#pragma once

#include "arduino/libraries/FreeRTOS/Arduino_FreeRTOS.h"
#include "arduino/libraries/FreeRTOS/freertos/objects.h"

using QueueHandle_t = qduino::arduino::freertos::Queue*;

/// Takes memory: for setup(). Null: it would have no item.
inline QueueHandle_t xQueueCreate(UBaseType_t length, UBaseType_t item_bytes) {
    return length > 0 ? new qduino::arduino::freertos::Queue(length, item_bytes) : nullptr;
}
inline void vQueueDelete(QueueHandle_t queue) { delete queue; }

inline BaseType_t xQueueSendToBack(QueueHandle_t queue, const void* item, TickType_t ticks) {
    return queue && queue->send(item, ticks) ? pdPASS : errQUEUE_FULL;
}
inline BaseType_t xQueueSend(QueueHandle_t queue, const void* item, TickType_t ticks) {
    return xQueueSendToBack(queue, item, ticks);
}
inline BaseType_t xQueueSendToFront(QueueHandle_t queue, const void* item, TickType_t ticks) {
    return queue && queue->send(item, ticks, true) ? pdPASS : errQUEUE_FULL;
}
/// Replaces the item of a queue that has room for one.
inline BaseType_t xQueueOverwrite(QueueHandle_t queue, const void* item) {
    queue->overwrite(item);
    return pdPASS;
}
inline BaseType_t xQueueReceive(QueueHandle_t queue, void* item, TickType_t ticks) {
    return queue && queue->receive(item, ticks) ? pdPASS : errQUEUE_EMPTY;
}
inline BaseType_t xQueuePeek(QueueHandle_t queue, void* item, TickType_t ticks) {
    return queue && queue->receive(item, ticks, false) ? pdPASS : errQUEUE_EMPTY;
}
inline BaseType_t xQueueReset(QueueHandle_t queue) {
    queue->reset();
    return pdPASS;
}
inline UBaseType_t uxQueueMessagesWaiting(QueueHandle_t queue) { return queue->size(); }
inline UBaseType_t uxQueueSpacesAvailable(QueueHandle_t queue) { return queue->room(); }

// From handlers, which do not wait.
inline BaseType_t xQueueSendFromISR(QueueHandle_t queue, const void* item, BaseType_t* woken = nullptr) {
    if (woken) *woken = pdFALSE;
    return xQueueSend(queue, item, 0);
}
inline BaseType_t xQueueSendToBackFromISR(QueueHandle_t queue, const void* item,
                                          BaseType_t* woken = nullptr) {
    return xQueueSendFromISR(queue, item, woken);
}
inline BaseType_t xQueueReceiveFromISR(QueueHandle_t queue, void* item, BaseType_t* woken = nullptr) {
    if (woken) *woken = pdFALSE;
    return xQueueReceive(queue, item, 0);
}
