#include "serial.h"

#include "scheduler.h"

HardwareSerial Serial("Serial", wire::HOST, 256);
HardwareSerial Serial2("Serial2", wire::SERVOS, 256);

size_t Stream::readBytes(uint8_t* into, size_t size) {
  int64_t until = board::now_ms() + static_cast<int64_t>(timeout_ms_);
  size_t taken = 0;
  while (taken < size) {
    int byte = read();
    if (byte >= 0) into[taken++] = static_cast<uint8_t>(byte);
    else if (board::now_ms() >= until) break;
  }
  return taken;
}

void HardwareSerial::begin(unsigned long baud, uint32_t config, int, int) {
  board::did(name_);
  if (kind_ == wire::SERVOS && baud != 1000000)
    board::fail(std::string(name_) + ".begin(" + std::to_string(baud) + "): the servos speak 1000000 baud");
  if (config != SERIAL_8N1) board::fail(std::string(name_) + ".begin: only SERIAL_8N1 is emulated");
  begun_ = true;
}

size_t HardwareSerial::write(const uint8_t* data, size_t size) {
  board::did(name_);
  if (begun_ && size) wire::send(kind_, data, size);
  return size;
}

void HardwareSerial::look() {
  // The firmware's servo library empties the queue before each packet, which marks the end of the previous packet.
  if (kind_ == wire::SERVOS) wire::end_of_packet();
  board::polled_input(name_);
}

int HardwareSerial::available() {
  look();
  return received_.size();
}

int HardwareSerial::read() {
  look();
  if (received_.empty()) return -1;
  board::did(name_);
  int byte = received_.front();
  received_.pop_front();
  return byte;
}

size_t HardwareSerial::read(uint8_t* into, size_t size) {
  size_t taken = 0;
  for (int byte; taken < size && (byte = read()) >= 0;) into[taken++] = static_cast<uint8_t>(byte);
  return taken;
}

int HardwareSerial::peek() {
  look();
  return received_.empty() ? -1 : received_.front();
}

void HardwareSerial::arrive(const char* data, size_t size) {
  for (size_t i = 0; begun_ && i < size && received_.size() < queue_; ++i) received_.push_back(static_cast<uint8_t>(data[i]));
}
