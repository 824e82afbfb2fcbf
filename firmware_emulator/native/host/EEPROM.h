// The EEPROM library is not supported (Preferences is): any use stops the program with a message.
#pragma once

#include "scheduler.h"

struct EEPROMClass {
  bool begin(size_t) { board::missing("EEPROM.begin()"); }
  uint8_t read(int) { board::missing("EEPROM.read()"); }
  void write(int, uint8_t) { board::missing("EEPROM.write()"); }
  bool commit() { board::missing("EEPROM.commit()"); }
};
inline EEPROMClass EEPROM;
