#include "wire.h"

#include <cstdlib>
#include <cstring>
#include <unistd.h>

#include "esp_system.h"
#include "scheduler.h"
#include "serial.h"
#include "storage.h"

extern "C" void __gcov_dump() __attribute__((weak));   // there in a build that counts executed lines

namespace wire {
namespace {

std::string outgoing;
size_t packet = std::string::npos;   // where the record of the present servo packet begins
int to_kernel = -1;

// The kernel has disconnected. Exit without destructors, because other tasks are still blocked.
[[noreturn]] void leave() {
  if (__gcov_dump) __gcov_dump();
  _exit(0);
}

void append(std::string& out, const void* data, size_t size) { out.append(static_cast<const char*>(data), size); }

void write_all(const std::string& data) {
  for (size_t done = 0; done < data.size();) {
    ssize_t n = write(to_kernel, data.data() + done, data.size() - done);
    if (n <= 0) leave();
    done += n;
  }
}

void read_all(void* into, size_t size) {
  char* at = static_cast<char*>(into);
  while (size) {
    ssize_t n = read(STDIN_FILENO, at, size);
    if (n <= 0) leave();
    at += n;
    size -= n;
  }
}

void take(char kind, const char* data, uint32_t size) {
  switch (kind) {
    case HOST: Serial.arrive(data, size); break;
    case SERVOS: Serial2.arrive(data, size); break;
    case STORE: storage::load(std::string(data, size)); break;
    case CAUSE: board::set_reset_reason(data[0]); break;
  }
}

void flush(int64_t wake_ms) {
  std::string message;
  uint32_t size = sizeof wake_ms + outgoing.size();
  append(message, &size, sizeof size);
  append(message, &wake_ms, sizeof wake_ms);
  message += outgoing;
  outgoing.clear();
  packet = std::string::npos;
  write_all(message);
}

void receive() {
  uint32_t size;
  read_all(&size, sizeof size);
  std::string message(size, '\0');
  read_all(&message[0], size);
  int64_t now;
  memcpy(&now, message.data(), sizeof now);
  board::set_now_ns(now);
  for (size_t at = sizeof now; at < message.size();) {
    uint32_t length;
    memcpy(&length, &message[at + 1], sizeof length);
    take(message[at], message.data() + at + 5, length);
    at += 5 + length;
  }
}

}  // namespace

void open() {
  to_kernel = dup(STDOUT_FILENO);
  dup2(STDERR_FILENO, STDOUT_FILENO);
  receive();
}

void exchange(int64_t wake_ms) {
  flush(wake_ms);
  receive();
}

void send(char kind, const void* data, size_t size) {
  uint32_t length = size;
  if (kind == SERVOS && packet != std::string::npos) {
    uint32_t before;
    memcpy(&before, &outgoing[packet + 1], sizeof before);
    before += length;
    memcpy(&outgoing[packet + 1], &before, sizeof before);
    append(outgoing, data, size);
    return;
  }
  packet = kind == SERVOS ? outgoing.size() : std::string::npos;
  outgoing += kind;
  append(outgoing, &length, sizeof length);
  append(outgoing, data, size);
}

void end_of_packet() { packet = std::string::npos; }

void wait_for_reset() {
  send(RESET, "", 0);
  flush(board::NEVER);
  for (;;) receive();
}

void report_failure(const std::string& message) {
  send(FAILED, message.data(), message.size());
  flush(board::NEVER);
}

}  // namespace wire
