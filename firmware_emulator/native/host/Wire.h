// I2C: included by the firmware, but unused. Any use stops the program with a message.
#pragma once

#include "scheduler.h"

struct TwoWire {
  bool begin(int = -1, int = -1, uint32_t = 0) { board::missing("Wire.begin()"); }
  void beginTransmission(int) { board::missing("Wire.beginTransmission()"); }
  uint8_t endTransmission(bool = true) { board::missing("Wire.endTransmission()"); }
  uint8_t requestFrom(int, int) { board::missing("Wire.requestFrom()"); }
};
inline TwoWire Wire;
