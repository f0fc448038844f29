// FreeRTOS for sketches, under the names of the library for AVR boards: tasks, notifications,
// queues (queue.h), semaphores (semphr.h), timers (timers.h) and groups of events (event_groups.h).
// (API: "The FreeRTOS Reference Manual", version 10; library "FreeRTOS" 11.1, feilipu.)
//
// What differs: a task is made in setup(), before the scheduler starts, and has a budget
// (freertos/tasks.h), so one that never waits takes no more than that. A tick is 1 ms. Another task
// that is suspended or deleted goes on until its next call that waits.
#pragma once

#include <cstdint>
#include <cstdlib>

#include "arduino/Arduino.h"
#include "arduino/libraries/FreeRTOS/freertos/tasks.h"

#define QDUINO_FREERTOS  // queue.h and the like are FreeRTOS' from here on

using BaseType_t = long;
using UBaseType_t = unsigned long;
using TickType_t = qduino::arduino::freertos::Ticks;
using StackType_t = std::uint8_t;
using configSTACK_DEPTH_TYPE = std::uint32_t;
using TaskFunction_t = void (*)(void*);
using TaskHandle_t = qduino::arduino::freertos::Task*;

enum eTaskState { eRunning = 0, eReady, eBlocked, eSuspended, eDeleted, eInvalid };
enum eNotifyAction { eNoAction = 0, eSetBits, eIncrement, eSetValueWithOverwrite, eSetValueWithoutOverwrite };

#define pdFALSE 0
#define pdTRUE 1
#define pdPASS 1
#define pdFAIL 0
#define errQUEUE_EMPTY 0
#define errQUEUE_FULL 0
#define errCOULD_NOT_ALLOCATE_REQUIRED_MEMORY (-1)

#define configTICK_RATE_HZ 1000
#define configMAX_PRIORITIES 4
#define configMINIMAL_STACK_SIZE 192
#define configMAX_TASK_NAME_LEN 16
#define configUSE_PREEMPTION 1
#define configUSE_MUTEXES 1
/// False: the sketch ends by abort(), and its line is named.
#define configASSERT(condition) ((condition) ? static_cast<void>(0) : std::abort())
#define tskIDLE_PRIORITY 0
#define portTICK_PERIOD_MS 1
#define portTICK_RATE_MS portTICK_PERIOD_MS
#define portMAX_DELAY (qduino::arduino::freertos::kForeverTicks)
#define pdMS_TO_TICKS(ms) (static_cast<TickType_t>(ms))
#define pdTICKS_TO_MS(ticks) (static_cast<std::uint32_t>(ticks))

/// pdPASS, or pdFAIL where setup() is over.
inline BaseType_t xTaskCreate(TaskFunction_t function, const char* name, std::uint32_t stack_depth,
                              void* parameters, UBaseType_t priority, TaskHandle_t* made = nullptr) {
    TaskHandle_t const task = qduino::arduino::freertos::make_task(function, name, stack_depth, parameters,
                                                                   static_cast<std::uint8_t>(priority));
    if (made) *made = task;
    return task ? pdPASS : pdFAIL;
}
/// The tasks begin when setup() ends; this returns, and does nothing.
inline void vTaskStartScheduler() {}
inline void vTaskDelay(TickType_t ticks) { qduino::arduino::freertos::sleep_ticks(ticks); }
/// pdFALSE: the instant was past.
inline BaseType_t xTaskDelayUntil(TickType_t* previous, TickType_t increment) {
    *previous += increment;
    return qduino::arduino::freertos::sleep_until_tick(*previous) ? pdTRUE : pdFALSE;
}
inline void vTaskDelayUntil(TickType_t* previous, TickType_t increment) {
    static_cast<void>(xTaskDelayUntil(previous, increment));
}
inline void vTaskDelete(TaskHandle_t task) { qduino::arduino::freertos::end_task(task); }
inline void vTaskSuspend(TaskHandle_t task) { qduino::arduino::freertos::suspend_task(task); }
inline void vTaskResume(TaskHandle_t task) {
    if (task) task->suspended.store(false);
}
inline BaseType_t xTaskResumeFromISR(TaskHandle_t task) {
    vTaskResume(task);
    return pdFALSE;
}
void taskYIELD();

inline TickType_t xTaskGetTickCount() { return qduino::arduino::freertos::tick_count(); }
inline TickType_t xTaskGetTickCountFromISR() { return xTaskGetTickCount(); }
inline TaskHandle_t xTaskGetCurrentTaskHandle() { return qduino::arduino::freertos::current_task(); }
inline UBaseType_t uxTaskGetNumberOfTasks() {
    return static_cast<UBaseType_t>(qduino::arduino::freertos::task_count());
}
/// A task's handle, or that of the caller where it is null.
TaskHandle_t qduino_task(TaskHandle_t task);
inline UBaseType_t uxTaskPriorityGet(TaskHandle_t task) {
    return qduino_task(task) ? qduino_task(task)->priority : 0;
}
inline const char* pcTaskGetName(TaskHandle_t task) {
    return qduino_task(task) ? qduino_task(task)->name : "";
}
inline eTaskState eTaskGetState(TaskHandle_t task) {
    return task ? static_cast<eTaskState>(qduino::arduino::freertos::state_of(*task)) : eInvalid;
}
/// A loop's stack is larger than any task asked for: all that it asked for is still free.
inline configSTACK_DEPTH_TYPE uxTaskGetStackHighWaterMark(TaskHandle_t task) {
    return qduino_task(task) ? qduino_task(task)->stack_depth : 0;
}

// ---- critical sections: of all tasks with all others, not of handlers ---------------------------

void taskENTER_CRITICAL();
void taskEXIT_CRITICAL();
inline void portENTER_CRITICAL() { taskENTER_CRITICAL(); }
inline void portEXIT_CRITICAL() { taskEXIT_CRITICAL(); }
inline void vTaskSuspendAll() { taskENTER_CRITICAL(); }
inline BaseType_t xTaskResumeAll() {
    taskEXIT_CRITICAL();
    return pdFALSE;
}
#define portYIELD_FROM_ISR(...)
#define taskDISABLE_INTERRUPTS() noInterrupts()
#define taskENABLE_INTERRUPTS() interrupts()

// ---- notifications ------------------------------------------------------------------------------

/// A task or a handler may call it.
BaseType_t xTaskNotify(TaskHandle_t task, std::uint32_t value, eNotifyAction action);
inline BaseType_t xTaskNotifyGive(TaskHandle_t task) { return xTaskNotify(task, 0, eIncrement); }
inline BaseType_t xTaskNotifyFromISR(TaskHandle_t task, std::uint32_t value, eNotifyAction action,
                                     BaseType_t* woken = nullptr) {
    if (woken) *woken = pdFALSE;
    return xTaskNotify(task, value, action);
}
inline void vTaskNotifyGiveFromISR(TaskHandle_t task, BaseType_t* woken = nullptr) {
    static_cast<void>(xTaskNotifyFromISR(task, 0, eIncrement, woken));
}
/// What was given until then; 0 when nothing came within `ticks`.
std::uint32_t ulTaskNotifyTake(BaseType_t clear, TickType_t ticks);
BaseType_t xTaskNotifyWait(std::uint32_t clear_first, std::uint32_t clear_last, std::uint32_t* value,
                           TickType_t ticks);
