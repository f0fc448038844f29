#include "arduino/libraries/FreeRTOS/Arduino_FreeRTOS.h"

namespace {

void notify(std::atomic<std::uint32_t>& notified, std::uint32_t value, eNotifyAction action) {
    if (action == eSetBits) notified.fetch_or(value);
    if (action == eIncrement) notified.fetch_add(1);
    if (action == eSetValueWithOverwrite || action == eSetValueWithoutOverwrite) notified.store(value);
}

}  // namespace

TaskHandle_t qduino_task(TaskHandle_t task) { return task ? task : xTaskGetCurrentTaskHandle(); }

void taskYIELD() { yield(); }

BaseType_t xTaskNotify(TaskHandle_t task, std::uint32_t value, eNotifyAction action) {
    if (!task || (action == eSetValueWithoutOverwrite && task->notification_waits.load())) return pdFAIL;
    notify(task->notified, value, action);
    task->notification_waits.store(true);
    return pdPASS;
}

std::uint32_t ulTaskNotifyTake(BaseType_t clear, TickType_t ticks) {
    TaskHandle_t const self = xTaskGetCurrentTaskHandle();
    if (!self) return 0;
    qduino::arduino::freertos::wait_until(ticks, [self] { return self->notified.load() != 0; });
    self->notification_waits.store(false);
    if (clear != pdFALSE) return self->notified.exchange(0);
    // It is the only one that takes, so what it has seen stays.
    return self->notified.load() == 0 ? 0 : self->notified.fetch_sub(1);
}

BaseType_t xTaskNotifyWait(std::uint32_t clear_first, std::uint32_t clear_last, std::uint32_t* value,
                           TickType_t ticks) {
    TaskHandle_t const self = xTaskGetCurrentTaskHandle();
    if (!self) return pdFALSE;
    if (!self->notification_waits.load()) self->notified.fetch_and(~clear_first);
    const bool came =
        qduino::arduino::freertos::wait_until(ticks, [self] { return self->notification_waits.load(); });
    if (value) *value = self->notified.load();
    if (came) self->notified.fetch_and(~clear_last);
    self->notification_waits.store(false);
    return came ? pdTRUE : pdFALSE;
}
