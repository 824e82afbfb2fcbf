// Resets.
#pragma once

#include <cstdint>

typedef enum {
  ESP_RST_UNKNOWN, ESP_RST_POWERON, ESP_RST_EXT, ESP_RST_SW, ESP_RST_PANIC, ESP_RST_INT_WDT, ESP_RST_TASK_WDT, ESP_RST_WDT,
  ESP_RST_DEEPSLEEP, ESP_RST_BROWNOUT, ESP_RST_SDIO, ESP_RST_USB
} esp_reset_reason_t;

esp_reset_reason_t esp_reset_reason();
[[noreturn]] void esp_restart();
uint32_t esp_random();

class EspClass {
 public:
  [[noreturn]] void restart() { esp_restart(); }
  uint32_t getFreeHeap() { return 300000; }
  uint32_t getHeapSize() { return 400000; }
  const char* getChipModel() { return "ESP32-S3"; }
};
extern EspClass ESP;

namespace board {
void set_reset_reason(int reason);
}
