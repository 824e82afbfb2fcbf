#include "storage.h"

#include <map>

#include "Preferences.h"
#include "scheduler.h"
#include "wire.h"

namespace storage {
namespace {
std::map<std::string, int64_t>& values() {
  static std::map<std::string, int64_t> all;
  return all;
}
}  // namespace

void load(const std::string& line) {
  size_t at = line.rfind('=');
  values()[line.substr(0, at)] = std::stoll(line.substr(at + 1));
}

bool get(const std::string& name, int64_t& value) {
  auto found = values().find(name);
  if (found == values().end()) return false;
  value = found->second;
  return true;
}

void put(const std::string& name, int64_t value) {
  values()[name] = value;
  std::string line = name + "=" + std::to_string(value);
  wire::send(wire::STORE, line.data(), line.size());
}

bool forget(const std::string& name) {
  if (!values().erase(name)) return false;
  wire::send(wire::FORGET, name.data(), name.size());
  return true;
}

void forget_all(const std::string& prefix) {
  std::map<std::string, int64_t> before = values();
  for (const auto& entry : before)
    if (entry.first.compare(0, prefix.size(), prefix) == 0) forget(entry.first);
}
}  // namespace storage

bool Preferences::begin(const char* name, bool read_only) {
  board::did("Preferences::begin()");
  if (open_) return false;
  name_ = std::string(name) + "/";
  read_only_ = read_only;
  return open_ = true;
}

void Preferences::end() { open_ = false; }

bool Preferences::clear() {
  if (!open_ || read_only_) return false;
  storage::forget_all(name_);
  return true;
}

bool Preferences::remove(const char* key) { return open_ && !read_only_ && storage::forget(name_ + key); }

bool Preferences::isKey(const char* key) {
  int64_t value;
  return open_ && storage::get(name_ + key, value);
}

size_t Preferences::put(const char* key, int64_t value, size_t size) {
  board::did("Preferences::put()");
  if (!open_ || read_only_) return 0;
  storage::put(name_ + key, value);
  return size;
}

int64_t Preferences::get(const char* key, int64_t other) {
  board::did("Preferences::get()");
  int64_t value;
  return open_ && storage::get(name_ + key, value) ? value : other;
}

size_t Preferences::putFloat(const char*, float) { board::missing("Preferences::putFloat()"); }
size_t Preferences::putString(const char*, const String&) { board::missing("Preferences::putString()"); }
size_t Preferences::putBytes(const char*, const void*, size_t) { board::missing("Preferences::putBytes()"); }
float Preferences::getFloat(const char*, float) { board::missing("Preferences::getFloat()"); }
String Preferences::getString(const char*, const String&) { board::missing("Preferences::getString()"); }
size_t Preferences::getBytes(const char*, void*, size_t) { board::missing("Preferences::getBytes()"); }
