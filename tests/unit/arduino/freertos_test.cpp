// FreeRTOS' tasks on the simulator: one sketch, which all tests look at when it has ended.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "arduino/core/diagnostics.h"
#include "arduino/libraries/FreeRTOS/Arduino_FreeRTOS.h"
#include "arduino/libraries/FreeRTOS/event_groups.h"
#include "arduino/libraries/FreeRTOS/queue.h"
#include "arduino/libraries/FreeRTOS/semphr.h"
#include "arduino/libraries/FreeRTOS/timers.h"
#include "board/board.h"
#include "board/peripherals.h"
#include "board/sim/sim_board.h"
#include "runtime/runtime.h"

namespace freertos_test {
namespace {

using namespace qduino;

QueueHandle_t queue;
SemaphoreHandle_t mutex, recursive, counting;
EventGroupHandle_t events;
TaskHandle_t held, sleeper, taker;
std::vector<std::string> order;
std::vector<TickType_t> ticks_of_periodic, ticks_of_timer;
int shots = 0, turns = 0, turns_while_suspended = -1;
bool destroyed_nothing = true;
std::uint32_t given = 0, waited_value = 0;
BaseType_t late_task = pdPASS, foreign_give = pdTRUE, twice = pdTRUE, timed_out = pdTRUE;
TickType_t time_out_took = 0;

void note(const char* what) { order.emplace_back(what); }

/// Has the mutex for 30 ms of sleep.
void hold(void*) {
    xSemaphoreTake(mutex, portMAX_DELAY);
    note("low has it");
    vTaskDelay(30);
    twice = xSemaphoreTake(mutex, 2);
    note("low gives it");
    xSemaphoreGive(mutex);
    vTaskDelete(nullptr);
    destroyed_nothing = false;
}

void want(void*) {
    vTaskDelay(5);
    const TickType_t asked = xTaskGetTickCount();
    timed_out = xSemaphoreTake(mutex, 10);
    time_out_took = xTaskGetTickCount() - asked;
    foreign_give = xSemaphoreGive(mutex);
    xSemaphoreTake(mutex, portMAX_DELAY);
    note("high has it");
    xSemaphoreGive(mutex);
    for (int i = 0; i < 3; ++i) xSemaphoreTakeRecursive(recursive, 0);
    for (int i = 0; i < 3; ++i) xSemaphoreGiveRecursive(recursive);
    note(xSemaphoreGiveRecursive(recursive) == pdFALSE ? "three is three" : "four");
}

void periodic(void*) {
    TickType_t woke = xTaskGetTickCount();
    for (;;) {
        vTaskDelayUntil(&woke, 15);
        ticks_of_periodic.push_back(xTaskGetTickCount());
        board::current().sleep_until(board::current().now() + 3ms);
    }
}

void turn(void*) {
    for (;;) {
        ++turns;
        vTaskDelay(1);
    }
}

void command(void*) {
    vTaskDelay(40);
    vTaskSuspend(sleeper);
    vTaskDelay(5);
    const int before = turns;
    vTaskDelay(50);
    turns_while_suspended = turns - before;
    vTaskResume(sleeper);
    for (int i = 0; i < 3; ++i) xTaskNotifyGive(taker);
    vTaskDelay(10);
    xTaskNotify(taker, 0x50, eSetBits);
    late_task = xTaskCreate(turn, "late", 100, nullptr, 1);
    int value = 1;
    xQueueSend(queue, &value, 0);
    value = 2;
    xQueueSendToFront(queue, &value, 0);
    value = 3;
    note(xQueueSend(queue, &value, 0) == errQUEUE_FULL ? "full" : "room");
    xQueueReceive(queue, &value, 0);
    note(value == 2 ? "two first" : "one first");
    xQueuePeek(queue, &value, 0);
    note(value == 1 && uxQueueMessagesWaiting(queue) == 1 ? "one is there" : "gone");
    for (int i = 0; i < 3; ++i) xSemaphoreGive(counting);
    note(uxSemaphoreGetCount(counting) == 2 ? "two at most" : "more");
    xEventGroupSetBits(events, 1);
    note(xEventGroupWaitBits(events, 3, pdTRUE, pdTRUE, 5) == 1 ? "one of two" : "both");
    note(xEventGroupWaitBits(events, 3, pdTRUE, pdFALSE, 5) == 1 ? "any" : "none");
    note(xEventGroupGetBits(events) == 0 ? "cleared" : "left");
}

void take(void*) {
    vTaskDelay(100);
    given = ulTaskNotifyTake(pdTRUE, portMAX_DELAY);
    xTaskNotifyWait(0, 0x10, &waited_value, portMAX_DELAY);
}

void setup() {
    queue = xQueueCreate(2, sizeof(int));
    mutex = xSemaphoreCreateMutex();
    recursive = xSemaphoreCreateRecursiveMutex();
    counting = xSemaphoreCreateCounting(2, 0);
    events = xEventGroupCreate();
    xTaskCreate(hold, "hold", 100, nullptr, 0, &held);
    xTaskCreate(want, "want", 100, nullptr, 3);
    xTaskCreate(periodic, "periodic", 100, nullptr, 2);
    xTaskCreate(turn, "turn", 100, nullptr, 2, &sleeper);
    xTaskCreate(command, "a name that is too long", 100, nullptr, 1);
    xTaskCreate(take, "take", 100, nullptr, 1, &taker);
    xTimerStart(xTimerCreate("again", 25, pdTRUE, nullptr,
                             [](TimerHandle_t) { ticks_of_timer.push_back(xTaskGetTickCount()); }),
                0);
    xTimerStart(xTimerCreate("once", 25, pdFALSE, nullptr, [](TimerHandle_t) { ++shots; }), 0);
}
const qduino::arduino::SketchRegistration registration(
    setup, [] { delay(100); }, nullptr, "test");

class FreeRtos : public testing::Test {
  protected:
    static void SetUpTestSuite() {
        qduino::arduino::set_error_handler([](const char*, int, const Error&) {});
        board::NoPeripherals nothing;
        board::sim::SimConfig config;
        config.cores = 2;
        board::sim::SimBoard board(config, nothing);
        runtime::Runtime runtime(board);
        const Result<void> begun = runtime.begin(runtime::sketch_table());
        ASSERT_TRUE(begun.ok()) << begun.error().message.view();
        runtime.run(kEpoch + 300ms);
        held_state = eTaskGetState(held);
        board.request_stop();
        runtime.run(board.now() + 1s);
        qduino::arduino::set_error_handler(nullptr);
    }
    static bool noted(const char* what) { return std::ranges::find(order, what) != order.end(); }

    static inline eTaskState held_state = eInvalid;
};

TEST_F(FreeRtos, AMutexHasOneHolderAndAWaitHasAnEnd) {
    EXPECT_EQ((std::vector<std::string>{order.begin(), order.begin() + 3}),
              (std::vector<std::string>{"low has it", "low gives it", "high has it"}));
    EXPECT_EQ(timed_out, pdFALSE);
    EXPECT_GE(time_out_took, 10u);
    EXPECT_LE(time_out_took, 14u);  // it has a budget, too
    EXPECT_EQ(foreign_give, pdFALSE);
    EXPECT_EQ(twice, pdFALSE);
    EXPECT_TRUE(noted("three is three"));
}

TEST_F(FreeRtos, ATaskThatDeletesItselfNeverReturns) {
    EXPECT_TRUE(destroyed_nothing);
    EXPECT_EQ(held_state, eDeleted);
}

TEST_F(FreeRtos, APeriodDoesNotGrowByWhatTheTaskDoes) {
    ASSERT_GE(ticks_of_periodic.size(), 15u);
    EXPECT_NEAR(ticks_of_periodic[14] - ticks_of_periodic[0], 14 * 15, 3);
}

TEST_F(FreeRtos, OneThatIsSuspendedStandsStillUntilItIsResumed) {
    EXPECT_EQ(turns_while_suspended, 0);
    EXPECT_GT(turns, 100);
}

TEST_F(FreeRtos, NotificationsAreCountedAndTheirBitsKept) {
    EXPECT_EQ(given, 3u);
    EXPECT_EQ(waited_value, 0x50u);
}

TEST_F(FreeRtos, QueuesAndCountsAndEventsKeepTheirBounds) {
    for (const char* what :
         {"full", "two first", "one is there", "two at most", "one of two", "any", "cleared"})
        EXPECT_TRUE(noted(what)) << what;
}

TEST_F(FreeRtos, TimersGoOffAgainOrOnce) {
    EXPECT_EQ(shots, 1);
    ASSERT_GE(ticks_of_timer.size(), 10u);
    for (std::size_t i = 0; i < ticks_of_timer.size(); ++i)
        EXPECT_NEAR(ticks_of_timer[i], 25 * (i + 1), 3) << i;
}

TEST_F(FreeRtos, TasksAreMadeInSetupAlone) {
    EXPECT_EQ(late_task, pdFAIL);
    EXPECT_EQ(uxTaskGetNumberOfTasks(), 7u);
}

}  // namespace
}  // namespace freertos_test
