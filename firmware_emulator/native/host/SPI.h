// SPI is not supported: any use stops the program with a message.
#pragma once

#include "scheduler.h"

struct SPIClass {
  void begin(int = -1, int = -1, int = -1, int = -1) { board::missing("SPI.begin()"); }
  uint8_t transfer(uint8_t) { board::missing("SPI.transfer()"); }
};
inline SPIClass SPI;
