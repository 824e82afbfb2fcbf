#include "scheduler.h"

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <mutex>
#include <thread>
#include <unistd.h>
#include <vector>

#include "wire.h"

namespace board {
namespace {

std::mutex baton;   // held by the thread whose task runs
std::vector<Task*> tasks;
Task* running = nullptr;
uint64_t orders = 0;
int64_t time_ns = 0;
const char* volatile last_call = "nothing yet";

void make_ready(Task* task) {
  task->state = Task::READY;
  task->wake_ms = NEVER;
  task->on = nullptr;
  task->polls = task->calls = 0;
  task->order = ++orders;
}

bool first(const Task* a, const Task* b) {
  return a->priority != b->priority ? a->priority > b->priority : a->order < b->order;
}

Task* most_important() {
  Task* best = nullptr;
  for (Task* task : tasks)
    if (task->state == Task::READY && (!best || first(task, best))) best = task;
  return best;
}

int64_t next_wake() {
  int64_t wake = NEVER;
  for (Task* task : tasks) {
    int64_t at = task->state == Task::SPINNING ? now_ms() + 1 : task->state == Task::BLOCKED ? task->wake_ms : NEVER;
    if (at != NEVER && (wake == NEVER || at < wake)) wake = at;
  }
  return wake;
}

// Lets the kernel advance time. At the new instant, tasks due at the tick run before polling ones.
void idle() {
  wire::exchange(next_wake());
  std::vector<Task*> due, spinning;
  for (Task* task : tasks) {
    if (task->state == Task::BLOCKED && task->wake_ms != NEVER && task->wake_ms <= now_ms()) due.push_back(task);
    if (task->state == Task::SPINNING) spinning.push_back(task);
  }
  auto earlier = [](const Task* a, const Task* b) {
    return a->wake_ms != b->wake_ms ? a->wake_ms < b->wake_ms : a->order < b->order;
  };
  std::sort(due.begin(), due.end(), earlier);
  std::sort(spinning.begin(), spinning.end(), [](const Task* a, const Task* b) { return a->order < b->order; });
  for (Task* task : due) make_ready(task);
  for (Task* task : spinning) make_ready(task);
}

// Passes control to the next task; returns when the caller is scheduled again.
void reschedule(std::unique_lock<std::mutex>& held, Task* self) {
  Task* next;
  while (!(next = most_important())) idle();
  if (next == self) return;
  running = next;
  next->turn.notify_one();
  self->turn.wait(held, [self] { return running == self; });
}

void leave(Task::State state) {
  Task* self = running;
  self->state = state;
  std::unique_lock<std::mutex> held(baton, std::adopt_lock);
  reschedule(held, self);
  held.release();
}

void spin() {
  running->order = ++orders;
  leave(Task::SPINNING);
}

void run(Task* self) {
  {
    std::unique_lock<std::mutex> held(baton);
    self->turn.wait(held, [self] { return running == self; });
    held.release();
  }
  self->body();
  end(self);
}

void preempt() {
  Task* best = most_important();
  if (best && best != running && best->priority > running->priority) leave(Task::READY);
}

void on_signal(int) {
  char text[256];
  int n = snprintf(text, sizeof text, "task '%s' runs without ever waiting or polling; its last call to the board was %s\n",
                   running ? running->name.c_str() : "?", last_call);
  (void)!write(STDERR_FILENO, text, n);
  _exit(1);
}

}  // namespace

Task* current() { return running; }
int64_t now_ns() { return time_ns; }
int64_t now_ms() { return time_ns / 1000000; }
void set_now_ns(int64_t ns) { time_ns = ns; }

Task* start(const char* name, int priority, std::function<void()> body) {
  Task* task = new Task;
  task->name = name;
  task->priority = priority;
  task->body = std::move(body);
  task->order = ++orders;
  tasks.push_back(task);
  std::thread(run, task).detach();
  preempt();
  return task;
}

void run_main(std::function<void()> body) {
  Task* task = new Task;
  task->name = "loopTask";
  tasks.push_back(task);
  running = task;
  baton.lock();
  body();
  fail("the main loop ended");
}

void end(Task* task) {
  bool own = task == running;
  task->state = Task::ENDED;
  if (own) leave(Task::ENDED);
}

void suspend(Task* task) {
  task->state = Task::SUSPENDED;
  if (task == running) leave(Task::SUSPENDED);
}

void resume(Task* task) {
  if (task->state != Task::SUSPENDED) return;
  make_ready(task);
  preempt();
}

bool block(const void* on, int64_t wake_ms) {
  Task* self = running;
  self->on = on;
  self->wake_ms = wake_ms;
  self->woken = false;
  self->order = ++orders;
  leave(Task::BLOCKED);
  return self->woken;
}

void wake_one(const void* on) {
  Task* best = nullptr;
  for (Task* task : tasks)
    if (task->state == Task::BLOCKED && task->on == on && (!best || first(task, best))) best = task;
  if (!best) return;
  make_ready(best);
  best->woken = true;
  preempt();
}

void yield_to_equals() {
  running->order = ++orders;
  leave(Task::READY);
}

void did(const char* call) {
  last_call = call;
  running->polls = 0;
  if (++running->calls >= SPIN_CALLS) spin();
}

void polled_input(const char* call) {
  last_call = call;
  ++running->calls;
  if (++running->polls >= SPIN_POLLS) spin();
}

void polled_clock(const char* call) {
  last_call = call;
  ++running->calls;
  if (++running->polls >= SPIN_CLOCK_POLLS) spin();
}

void fail(const std::string& message) {
  wire::report_failure(message);
  _exit(1);
}

void missing(const char* call) {
  fail(std::string(call) + " is not on the emulated board; leave it out of the emulated build, for example with "
       "#ifndef AERO_EMULATED_BOARD");
}

void watch_for_signals() { signal(SIGUSR1, on_signal); }

}  // namespace board
