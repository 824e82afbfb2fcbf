#include "Arduino.h"

#include "esp_timer.h"
#include "scheduler.h"

namespace {
esp_reset_reason_t reset_reason = ESP_RST_POWERON;
uint32_t random_state = 1;

uint32_t next_random() {
  random_state ^= random_state << 13;
  random_state ^= random_state >> 17;
  return random_state ^= random_state << 5;
}
}  // namespace

EspClass ESP;

namespace board {
void set_reset_reason(int reason) { reset_reason = static_cast<esp_reset_reason_t>(reason); }
}

esp_reset_reason_t esp_reset_reason() { return reset_reason; }
void esp_restart() { wire::wait_for_reset(); }
uint32_t esp_random() { return next_random(); }

unsigned long millis() {
  board::polled_clock("millis()");
  return static_cast<unsigned long>(board::now_ms());
}

unsigned long micros() { return static_cast<unsigned long>(esp_timer_get_time()); }

int64_t esp_timer_get_time() {
  board::polled_clock("micros()");
  return board::now_ns() / 1000;
}

void delay(uint32_t milliseconds) { vTaskDelay(pdMS_TO_TICKS(milliseconds)); }

void delayMicroseconds(uint32_t microseconds) {
  // A busy wait on the chip. Here running code takes no time, so whole milliseconds are waited instead.
  board::did("delayMicroseconds()");
  if (microseconds >= 1000) board::block(nullptr, board::now_ms() + microseconds / 1000);
}

void yield() { board::yield_to_equals(); }

long map(long x, long in_low, long in_high, long out_low, long out_high) {
  long run = in_high - in_low;
  return run == 0 ? -1 : (x - in_low) * (out_high - out_low) / run + out_low;
}

void pinMode(uint8_t, uint8_t) { board::did("pinMode()"); }
void digitalWrite(uint8_t, uint8_t) { board::did("digitalWrite()"); }
int digitalRead(uint8_t) { board::missing("digitalRead()"); }
int analogRead(uint8_t) { board::missing("analogRead()"); }
void analogWrite(uint8_t, int) { board::missing("analogWrite()"); }
void randomSeed(unsigned long seed) { random_state = seed ? static_cast<uint32_t>(seed) : 1; }
long random(long below) { return below > 0 ? static_cast<long>(next_random() % static_cast<uint32_t>(below)) : 0; }
long random(long from, long below) { return from + random(below - from); }
