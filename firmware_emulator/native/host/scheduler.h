// Tasks on virtual time. One task runs at a time and code takes no time: time advances only when all tasks wait.
//
// A task that polls repeatedly (empty queue, clock) without news "spins". After SPIN_POLLS such calls at one instant
// the task is suspended until bytes arrive or the next millisecond begins, as seen by a polling loop on the real chip.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <string>

namespace board {

constexpr int64_t NEVER = -1;
constexpr unsigned SPIN_POLLS = 1000;         // of input; about what the chip does in a millisecond
constexpr unsigned SPIN_CLOCK_POLLS = 1500;   // of the clock: later, so that waiting for input sees the input first
constexpr unsigned SPIN_CALLS = 20000;        // of anything, so that a loop that only prints lets time pass too

struct Task {
  enum State { READY, SPINNING, BLOCKED, SUSPENDED, ENDED };
  std::string name;
  int priority = 1;
  State state = READY;
  int64_t wake_ms = NEVER;      // BLOCKED until then at the latest
  const void* on = nullptr;     // what it is BLOCKED on besides, nullptr for a plain delay
  bool woken = false;           // whether that ended the wait, not the time
  uint64_t order = 0;           // among equals, the lower runs first
  unsigned polls = 0, calls = 0;
  uint32_t notified = 0;
  std::function<void()> body;
  std::condition_variable turn;
};

Task* start(const char* name, int priority, std::function<void()> body);   // READY, and at once where more important
void run_main(std::function<void()> body);                                 // becomes the first task; never returns
Task* current();
void end(Task* task);
void suspend(Task* task);
void resume(Task* task);

// Waits until `wake_ms` or until another task wakes `on`; returns whether woken.
bool block(const void* on, int64_t wake_ms);
// Wakes the highest-priority task waiting on `on`; if above the caller's priority, that task runs at once.
void wake_one(const void* on);
void yield_to_equals();

void did(const char* call);            // a call that got something done
void polled_input(const char* call);   // a look at an input that may be empty
void polled_clock(const char* call);

int64_t now_ns();
int64_t now_ms();
void set_now_ns(int64_t ns);

[[noreturn]] void fail(const std::string& message);     // ends the program; the kernel shows the message
[[noreturn]] void missing(const char* call);            // a call that this board does not have
void watch_for_signals();                               // says on SIGUSR1 which task runs

}  // namespace board
