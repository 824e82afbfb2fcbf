#pragma once

#include "FreeRTOS.h"

namespace board { struct Task; }
typedef board::Task* TaskHandle_t;
typedef void (*TaskFunction_t)(void*);
typedef enum { eNoAction, eSetBits, eIncrement, eSetValueWithOverwrite } eNotifyAction;

BaseType_t xTaskCreate(TaskFunction_t code, const char* name, uint32_t stack, void* argument, UBaseType_t priority, TaskHandle_t* handle);
BaseType_t xTaskCreatePinnedToCore(TaskFunction_t code, const char* name, uint32_t stack, void* argument, UBaseType_t priority,
                                   TaskHandle_t* handle, BaseType_t core);
void vTaskDelete(TaskHandle_t task);
void vTaskDelay(TickType_t ticks);
BaseType_t xTaskDelayUntil(TickType_t* previous_wake, TickType_t period);
#define vTaskDelayUntil(previous_wake, period) ((void)xTaskDelayUntil(previous_wake, period))
TickType_t xTaskGetTickCount();
void taskYIELD();
void vTaskSuspend(TaskHandle_t task);
void vTaskResume(TaskHandle_t task);
TaskHandle_t xTaskGetCurrentTaskHandle();
void vTaskPrioritySet(TaskHandle_t task, UBaseType_t priority);
UBaseType_t uxTaskGetStackHighWaterMark(TaskHandle_t task);
BaseType_t xPortGetCoreID();
BaseType_t xTaskNotifyGive(TaskHandle_t task);
uint32_t ulTaskNotifyTake(BaseType_t clear, TickType_t ticks);
