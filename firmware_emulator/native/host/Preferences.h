// Stored settings; integers only.
#pragma once

#include <cstdint>
#include <string>

#include "print.h"

class Preferences {
 public:
  bool begin(const char* name, bool read_only = false);   // false, and without effect, while it is open
  void end();
  bool clear();
  bool remove(const char* key);
  bool isKey(const char* key);

  size_t putChar(const char* key, int8_t value) { return put(key, value, 1); }
  size_t putUChar(const char* key, uint8_t value) { return put(key, value, 1); }
  size_t putShort(const char* key, int16_t value) { return put(key, value, 2); }
  size_t putUShort(const char* key, uint16_t value) { return put(key, value, 2); }
  size_t putInt(const char* key, int32_t value) { return put(key, value, 4); }
  size_t putUInt(const char* key, uint32_t value) { return put(key, value, 4); }
  size_t putLong(const char* key, int32_t value) { return put(key, value, 4); }
  size_t putULong(const char* key, uint32_t value) { return put(key, value, 4); }
  size_t putLong64(const char* key, int64_t value) { return put(key, value, 8); }
  size_t putBool(const char* key, bool value) { return put(key, value, 1); }
  size_t putFloat(const char* key, float value);
  size_t putString(const char* key, const String& value);
  size_t putBytes(const char* key, const void* value, size_t size);

  int8_t getChar(const char* key, int8_t other = 0) { return static_cast<int8_t>(get(key, other)); }
  uint8_t getUChar(const char* key, uint8_t other = 0) { return static_cast<uint8_t>(get(key, other)); }
  int16_t getShort(const char* key, int16_t other = 0) { return static_cast<int16_t>(get(key, other)); }
  uint16_t getUShort(const char* key, uint16_t other = 0) { return static_cast<uint16_t>(get(key, other)); }
  int32_t getInt(const char* key, int32_t other = 0) { return static_cast<int32_t>(get(key, other)); }
  uint32_t getUInt(const char* key, uint32_t other = 0) { return static_cast<uint32_t>(get(key, other)); }
  int32_t getLong(const char* key, int32_t other = 0) { return static_cast<int32_t>(get(key, other)); }
  uint32_t getULong(const char* key, uint32_t other = 0) { return static_cast<uint32_t>(get(key, other)); }
  int64_t getLong64(const char* key, int64_t other = 0) { return get(key, other); }
  bool getBool(const char* key, bool other = false) { return get(key, other) != 0; }
  float getFloat(const char* key, float other = 0);
  String getString(const char* key, const String& other = String());
  size_t getBytes(const char* key, void* value, size_t size);

 private:
  size_t put(const char* key, int64_t value, size_t size);
  int64_t get(const char* key, int64_t other);
  std::string name_;
  bool open_ = false, read_only_ = false;
};
