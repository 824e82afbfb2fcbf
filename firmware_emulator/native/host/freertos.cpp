#include <cstring>
#include <deque>
#include <vector>

#include "freertos/queue.h"
#include "freertos/semphr.h"
#include "freertos/task.h"
#include "freertos/timers.h"
#include "scheduler.h"

namespace board {
struct Semaphore {
  enum Kind { MUTEX, RECURSIVE, COUNTING } kind;
  unsigned count, maximum;
  Task* holder = nullptr;
  unsigned depth = 0;
};
struct Queue {
  unsigned length, item_size;
  std::deque<std::vector<uint8_t>> items;
  char room = 0;   // its address is what those wait on who want to send
};
struct Timer {
  TickType_t period;
  bool repeats;
  void* id;
  TimerCallbackFunction_t callback;
  bool armed = false;
  int64_t due_ms = 0;
};
}  // namespace board

using namespace board;

namespace {

int64_t deadline(TickType_t ticks) { return ticks == portMAX_DELAY ? NEVER : now_ms() + ticks; }

// Waits on `what` until `free()` or a time-out; returns the last value of `free()`.
template <typename Free> bool wait_until(const char* call, const void* what, TickType_t ticks, Free free) {
  polled_clock(call);
  int64_t until = deadline(ticks);
  while (!free()) {
    if (ticks == 0 || (until != NEVER && now_ms() >= until)) return false;
    block(what, until);
  }
  return true;
}

template <typename Handle> Handle checked(const char* call, Handle handle) {
  if (!handle) fail(std::string(call) + " on a handle that was never created; the chip stops here too");
  return handle;
}

std::vector<Timer*> timers;
Task* timer_task = nullptr;

void serve_timers() {
  for (;;) {
    int64_t next = NEVER;
    for (Timer* timer : timers)
      if (timer->armed && (next == NEVER || timer->due_ms < next)) next = timer->due_ms;
    if (next == NEVER || next > now_ms()) {
      block(&timers, next);
      continue;
    }
    for (Timer* timer : timers)
      if (timer->armed && timer->due_ms == next) {
        timer->armed = timer->repeats;
        timer->due_ms += timer->period;
        timer->callback(timer);
        break;
      }
  }
}

BaseType_t arm(TimerHandle_t timer, const char* call) {
  checked(call, timer)->armed = true;
  timer->due_ms = now_ms() + timer->period;
  wake_one(&timers);
  return pdPASS;
}

}  // namespace

// Tasks

BaseType_t xTaskCreate(TaskFunction_t code, const char* name, uint32_t, void* argument, UBaseType_t priority, TaskHandle_t* handle) {
  did("xTaskCreate()");
  Task* task = start(name, priority, [code, argument] {
    code(argument);
    fail("task '" + current()->name + "' returned; the chip stops here too");
  });
  if (handle) *handle = task;
  return pdPASS;
}
BaseType_t xTaskCreatePinnedToCore(TaskFunction_t code, const char* name, uint32_t stack, void* argument, UBaseType_t priority,
                                   TaskHandle_t* handle, BaseType_t) {
  return xTaskCreate(code, name, stack, argument, priority, handle);
}
void vTaskDelete(TaskHandle_t task) { end(task ? task : current()); }
void vTaskDelay(TickType_t ticks) {
  did("vTaskDelay()");
  if (ticks == 0) yield_to_equals();
  else block(nullptr, deadline(ticks));
}
BaseType_t xTaskDelayUntil(TickType_t* previous_wake, TickType_t period) {
  did("vTaskDelayUntil()");
  *previous_wake += period;
  int32_t left = static_cast<int32_t>(*previous_wake - static_cast<uint32_t>(now_ms()));
  if (left <= 0) return pdFALSE;
  block(nullptr, now_ms() + left);
  return pdTRUE;
}
TickType_t xTaskGetTickCount() {
  polled_clock("xTaskGetTickCount()");
  return static_cast<TickType_t>(now_ms());
}
void taskYIELD() { yield_to_equals(); }
void vTaskSuspend(TaskHandle_t task) { suspend(task ? task : current()); }
void vTaskResume(TaskHandle_t task) { resume(checked("vTaskResume()", task)); }
TaskHandle_t xTaskGetCurrentTaskHandle() { return current(); }
void vTaskPrioritySet(TaskHandle_t task, UBaseType_t priority) { (task ? task : current())->priority = priority; }
UBaseType_t uxTaskGetStackHighWaterMark(TaskHandle_t) { return 1024; }
BaseType_t xPortGetCoreID() { return 1; }
BaseType_t xTaskNotifyGive(TaskHandle_t task) {
  did("xTaskNotifyGive()");
  ++checked("xTaskNotifyGive()", task)->notified;
  wake_one(&task->notified);
  return pdPASS;
}
uint32_t ulTaskNotifyTake(BaseType_t clear, TickType_t ticks) {
  Task* self = current();
  if (!wait_until("ulTaskNotifyTake()", &self->notified, ticks, [self] { return self->notified > 0; })) return 0;
  uint32_t before = self->notified;
  self->notified = clear ? 0 : before - 1;
  return before;
}

// Semaphores

SemaphoreHandle_t xSemaphoreCreateMutex() { return new Semaphore{Semaphore::MUTEX, 1, 1}; }
SemaphoreHandle_t xSemaphoreCreateRecursiveMutex() { return new Semaphore{Semaphore::RECURSIVE, 1, 1}; }
SemaphoreHandle_t xSemaphoreCreateBinary() { return new Semaphore{Semaphore::COUNTING, 0, 1}; }
SemaphoreHandle_t xSemaphoreCreateCounting(UBaseType_t maximum, UBaseType_t initial) {
  return new Semaphore{Semaphore::COUNTING, initial, maximum};
}
BaseType_t xSemaphoreTake(SemaphoreHandle_t semaphore, TickType_t ticks) {
  checked("xSemaphoreTake()", semaphore);
  if (!wait_until("xSemaphoreTake()", semaphore, ticks, [semaphore] { return semaphore->count > 0; })) return pdFALSE;
  --semaphore->count;
  semaphore->holder = current();
  return pdTRUE;
}
BaseType_t xSemaphoreGive(SemaphoreHandle_t semaphore) {
  checked("xSemaphoreGive()", semaphore);
  if (semaphore->kind != Semaphore::COUNTING && semaphore->count == 0 && semaphore->holder != current())
    fail("task '" + current()->name + "' gives back a mutex that task '" + semaphore->holder->name + "' holds; the chip stops here too");
  if (semaphore->count >= semaphore->maximum) return pdFALSE;
  ++semaphore->count;
  semaphore->holder = nullptr;
  wake_one(semaphore);
  return pdTRUE;
}
BaseType_t xSemaphoreTakeRecursive(SemaphoreHandle_t semaphore, TickType_t ticks) {
  if (checked("xSemaphoreTakeRecursive()", semaphore)->holder != current() && !xSemaphoreTake(semaphore, ticks)) return pdFALSE;
  ++semaphore->depth;
  return pdTRUE;
}
BaseType_t xSemaphoreGiveRecursive(SemaphoreHandle_t semaphore) {
  if (checked("xSemaphoreGiveRecursive()", semaphore)->holder != current()) return pdFALSE;
  return --semaphore->depth ? pdTRUE : xSemaphoreGive(semaphore);
}
void vSemaphoreDelete(SemaphoreHandle_t semaphore) { delete semaphore; }

// Queues

QueueHandle_t xQueueCreate(UBaseType_t length, UBaseType_t item_size) { return new Queue{length, item_size, {}}; }
BaseType_t xQueueSend(QueueHandle_t queue, const void* item, TickType_t ticks) {
  checked("xQueueSend()", queue);
  if (!wait_until("xQueueSend()", &queue->room, ticks, [queue] { return queue->items.size() < queue->length; })) return pdFALSE;
  auto bytes = static_cast<const uint8_t*>(item);
  queue->items.emplace_back(bytes, bytes + queue->item_size);
  wake_one(queue);
  return pdTRUE;
}
BaseType_t xQueuePeek(QueueHandle_t queue, void* item, TickType_t ticks) {
  checked("xQueueReceive()", queue);
  if (!wait_until("xQueueReceive()", queue, ticks, [queue] { return !queue->items.empty(); })) return pdFALSE;
  memcpy(item, queue->items.front().data(), queue->item_size);
  return pdTRUE;
}
BaseType_t xQueueReceive(QueueHandle_t queue, void* item, TickType_t ticks) {
  if (!xQueuePeek(queue, item, ticks)) return pdFALSE;
  queue->items.pop_front();
  wake_one(&queue->room);
  return pdTRUE;
}
BaseType_t xQueueOverwrite(QueueHandle_t queue, const void* item) {
  checked("xQueueOverwrite()", queue)->items.clear();
  return xQueueSend(queue, item, 0);
}
BaseType_t xQueueReset(QueueHandle_t queue) {
  checked("xQueueReset()", queue)->items.clear();
  wake_one(&queue->room);
  return pdPASS;
}
UBaseType_t uxQueueMessagesWaiting(QueueHandle_t queue) {
  polled_clock("uxQueueMessagesWaiting()");
  return checked("uxQueueMessagesWaiting()", queue)->items.size();
}
void vQueueDelete(QueueHandle_t queue) { delete queue; }

// Timers, served by a separate task

TimerHandle_t xTimerCreate(const char*, TickType_t period, BaseType_t repeats, void* id, TimerCallbackFunction_t callback) {
  if (!timer_task) timer_task = start("Tmr Svc", 1, serve_timers);
  timers.push_back(new Timer{period, repeats != pdFALSE, id, callback});
  return timers.back();
}
BaseType_t xTimerStart(TimerHandle_t timer, TickType_t) { return arm(timer, "xTimerStart()"); }
BaseType_t xTimerReset(TimerHandle_t timer, TickType_t) { return arm(timer, "xTimerReset()"); }
BaseType_t xTimerChangePeriod(TimerHandle_t timer, TickType_t period, TickType_t) {
  checked("xTimerChangePeriod()", timer)->period = period;
  return arm(timer, "xTimerChangePeriod()");
}
BaseType_t xTimerStop(TimerHandle_t timer, TickType_t) {
  checked("xTimerStop()", timer)->armed = false;
  return pdPASS;
}
void* pvTimerGetTimerID(TimerHandle_t timer) { return checked("pvTimerGetTimerID()", timer)->id; }
