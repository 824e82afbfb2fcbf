// Protocol with the kernel, which owns time. Output: next wake-up time of all tasks and transmitted bytes. Input:
// present time and received bytes. Both little-endian: length (u32), time (i64) and records, each of a letter, a length
// (u32) and bytes.
#pragma once

#include <cstdint>
#include <string>

namespace wire {

void open();                                    // takes stdin and stdout; what the firmware prints goes to stderr
void exchange(int64_t wake_ms);                 // sends what was collected, takes what came
void send(char kind, const void* data, size_t size);   // collects a record
void end_of_packet();                           // bytes for the servos after this belong to another packet
[[noreturn]] void wait_for_reset();
void report_failure(const std::string& message);

enum Kind : char { HOST = 'H', SERVOS = 'U', STORE = 'N', FORGET = 'X', CAUSE = 'C', READY = 'S', RESET = 'R', FAILED = 'E' };

}  // namespace wire
