// A small firmware of our own: frames of 16 bytes from the host, packets to the servos, a task that reads positions.
// Frames 0x70 and up are faults that the emulated board has to name.
#include <Preferences.h>
#include <WiFi.h>

#include "channels.h"

Preferences store;
SemaphoreHandle_t bus;
uint16_t positions[CHANNELS];
volatile bool forever = true;

void setup() {
  Serial.begin(921600);
  delay(100);
  Serial2.begin(1000000, SERIAL_8N1, 2, 3);
  store.begin("hand");
  int boots = store.getInt("boots", 0) + 1;
  store.putInt("boots", boots);
  Serial.printf("[BOOT] %d, reason %d\n", boots, esp_reset_reason());
  bus = xSemaphoreCreateMutex();
  xTaskCreatePinnedToCore(readPositions, "positions", 4096, nullptr, 1, nullptr, 1);
}

void loop() {
  if (Serial.available() < 16) return;
  uint8_t frame[16];
  Serial.read(frame, sizeof frame);
  handle(frame[0], frame + 2);
}

static void readPositions(void *) {
  TickType_t wake = xTaskGetTickCount();
  for (;;) {
    for (uint8_t id = 0; id < CHANNELS; ++id) {
      int value = readWord(id, 56);
      if (value >= 0) positions[id] = value;
    }
    vTaskDelayUntil(&wake, pdMS_TO_TICKS(20));
  }
}

static void handle(uint8_t op, const uint8_t *payload) {
  uint16_t words[CHANNELS] = {0};
  switch (op) {
    case 0x01:
      for (uint8_t id = 0; id < CHANNELS; ++id) home(id);
      return answer(op, words);
    case 0x11:
      for (uint8_t id = 0; id < CHANNELS; ++id) {
        uint8_t goal[8] = {41, 0, payload[2 * id], payload[2 * id + 1], 0xf4, 0x01, 0x60, 0x09};
        command(id, 3, goal, sizeof goal);
      }
      return;
    case 0x22:
      return answer(op, positions);
    case 0x70:
      while (forever) { }
      return;
    case 0x71:
      words[payload[0]] = 1;
      return answer(op, words);
    case 0x72:
      WiFi.begin("hand");
      return;
    case 0x73:
      ESP.restart();
  }
}

// Pushes a servo against its stop and makes that its middle.
static void home(uint8_t id) {
  uint8_t push[8] = {41, 0, 0x00, 0x40, 0xf4, 0x01, 0x60, 0x09};
  for (uint32_t start = millis(); millis() - start < 3000;) {
    command(id, 3, push, sizeof push);
    if ((readWord(id, 69) & 0x7fff) >= 480) break;
    vTaskDelay(1);
  }
  command(id, 0x0b, nullptr, 0);
}

static void answer(uint8_t op, const uint16_t *words) {
  uint8_t out[16] = {op, 0};
  memcpy(out + 2, words, 14);
  Serial.write(out, sizeof out);
}

static int readWord(uint8_t id, uint8_t address) {
  uint8_t ask[2] = {address, 2}, got[2];
  return exchange(id, 2, ask, 2, got, 2) ? got[0] | got[1] << 8 : -1;
}

static bool command(uint8_t id, uint8_t code, const uint8_t *parameters, uint8_t count) {
  return exchange(id, code, parameters, count, nullptr, 0);
}

static bool exchange(uint8_t id, uint8_t code, const uint8_t *parameters, uint8_t count, uint8_t *data, uint8_t size) {
  xSemaphoreTake(bus, portMAX_DELAY);
  while (Serial2.read() >= 0) { }
  uint8_t head[5] = {0xff, 0xff, id, uint8_t(count + 2), code}, sum = id + count + 2 + code;
  for (uint8_t i = 0; i < count; ++i) sum += parameters[i];
  Serial2.write(head, sizeof head);
  if (count) Serial2.write(parameters, count);
  Serial2.write(uint8_t(~sum));
  uint8_t got[16];
  uint32_t start = millis();
  while (Serial2.available() < size + 6 && millis() - start < 10) { }
  bool whole = Serial2.read(got, size + 6) == size_t(size + 6);
  if (whole && data) memcpy(data, got + 5, size);
  xSemaphoreGive(bus);
  return whole;
}
