#include <Arduino_FreeRTOS.h>
#include <event_groups.h>
#include <queue.h>
#include <semphr.h>
#include <timers.h>

struct Reading {
  int pin;
  int value;
};

QueueHandle_t readings;
SemaphoreHandle_t serial, pressed;
EventGroupHandle_t done;
TaskHandle_t summer;
int beats = 0;

void say(const char* words, long number) {
  xSemaphoreTake(serial, portMAX_DELAY);
  Serial.print(words);
  Serial.print(' ');
  Serial.println(number);
  xSemaphoreGive(serial);
}

void read(void* pin) {
  TickType_t woke = xTaskGetTickCount();
  for (int i = 0; i < 10; i++) {
    Reading reading{static_cast<int>(reinterpret_cast<intptr_t>(pin)), i};
    xQueueSend(readings, &reading, portMAX_DELAY);
    vTaskDelayUntil(&woke, 20 / portTICK_PERIOD_MS);
  }
  xEventGroupSetBits(done, 1u << reinterpret_cast<intptr_t>(pin));
  vTaskDelete(NULL);
}

void sum(void*) {
  long total = 0;
  Reading reading;
  while (xQueueReceive(readings, &reading, 100) == pdPASS) total += 100 * reading.pin + reading.value;
  say("sum", total);
  say("notified", ulTaskNotifyTake(pdTRUE, portMAX_DELAY));
  for (;;) vTaskDelay(1000);
}

void greedy(void*) {
  for (volatile long i = 0;;) {
    i = i + 1;
  }
}

void beat(TimerHandle_t) {
  if (++beats == 5) xSemaphoreGive(pressed);
}

void waiter(void*) {
  say("early", xSemaphoreTake(pressed, 10));
  say("beats", xSemaphoreTake(pressed, portMAX_DELAY) ? beats : -1);
  say("bits", xEventGroupWaitBits(done, 6, pdTRUE, pdTRUE, portMAX_DELAY));
  say("left", xEventGroupGetBits(done));
  say("state", eTaskGetState(summer));
  xTaskNotify(summer, 42, eSetValueWithOverwrite);
  vTaskSuspend(NULL);
  say("never", 0);
}

void setup() {
  Serial.begin(115200);
  readings = xQueueCreate(4, sizeof(Reading));
  serial = xSemaphoreCreateMutex();
  pressed = xSemaphoreCreateBinary();
  done = xEventGroupCreate();
  xTaskCreate(read, "read 1", 128, reinterpret_cast<void*>(1), 2, NULL);
  xTaskCreate(read, "read 2", 128, reinterpret_cast<void*>(2), 2, NULL);
  xTaskCreate(sum, "sum", 128, NULL, 1, &summer);
  xTaskCreate(greedy, "greedy", 128, NULL, 3, NULL);
  xTaskCreate(waiter, "waiter", 128, NULL, 1, NULL);
  xTimerStart(xTimerCreate("beat", 30, pdTRUE, NULL, beat), 0);
  Serial.println(uxTaskGetNumberOfTasks());
}

void loop() {}
