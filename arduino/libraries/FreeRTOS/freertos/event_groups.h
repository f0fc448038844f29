// Groups of events of FreeRTOS (Arduino_FreeRTOS.h).
#pragma once

#include "arduino/libraries/FreeRTOS/Arduino_FreeRTOS.h"
#include "arduino/libraries/FreeRTOS/freertos/objects.h"

using EventBits_t = std::uint32_t;
using EventGroupHandle_t = qduino::arduino::freertos::EventGroup*;

/// Takes memory: for setup().
inline EventGroupHandle_t xEventGroupCreate() { return new qduino::arduino::freertos::EventGroup; }
inline void vEventGroupDelete(EventGroupHandle_t group) { delete group; }
inline EventBits_t xEventGroupSetBits(EventGroupHandle_t group, EventBits_t bits) { return group->set(bits); }
/// The bits as they were.
inline EventBits_t xEventGroupClearBits(EventGroupHandle_t group, EventBits_t bits) {
    return group->clear(bits);
}
inline EventBits_t xEventGroupGetBits(EventGroupHandle_t group) { return group->get(); }
inline EventBits_t xEventGroupWaitBits(EventGroupHandle_t group, EventBits_t bits, BaseType_t clear_after,
                                       BaseType_t all, TickType_t ticks) {
    return group->wait(bits, clear_after != pdFALSE, all != pdFALSE, ticks);
}
