// USB port to the host and UART to the servos.
#pragma once

#include <deque>

#include "print.h"
#include "wire.h"

#define SERIAL_8N1 0x800001c

class Stream : public Print {
 public:
  virtual int available() = 0;
  virtual int read() = 0;
  virtual int peek() = 0;
  void setTimeout(unsigned long milliseconds) { timeout_ms_ = milliseconds; }
  size_t readBytes(uint8_t* into, size_t size);
  size_t readBytes(char* into, size_t size) { return readBytes(reinterpret_cast<uint8_t*>(into), size); }

 protected:
  unsigned long timeout_ms_ = 1000;
};

// One port. Bytes beyond the queue size are dropped, as by the drivers of arduino-esp32.
class HardwareSerial : public Stream {
 public:
  HardwareSerial(const char* name, char kind, size_t queue) : name_(name), kind_(kind), queue_(queue) {}
  void begin(unsigned long baud = 115200, uint32_t config = SERIAL_8N1, int rx = -1, int tx = -1);
  void end() {}
  using Print::write;
  size_t write(const uint8_t* data, size_t size) override;
  int available() override;
  int read() override;
  size_t read(uint8_t* into, size_t size);
  int peek() override;
  int availableForWrite() { return 256; }
  size_t setRxBufferSize(size_t size) { return queue_ = size; }
  size_t setTxBufferSize(size_t size) { return size; }
  void setTxTimeoutMs(uint32_t) {}
  operator bool() const { return true; }
  void arrive(const char* data, size_t size);   // from the kernel

 private:
  void look();
  const char* name_;
  char kind_;
  size_t queue_;
  bool begun_ = false;
  std::deque<uint8_t> received_;
};

using HWCDC = HardwareSerial;

extern HardwareSerial Serial;    // USB CDC, to the host
extern HardwareSerial Serial2;   // UART, to the servos
