// Main of arduino-esp32: `setup` once and `loop` forever, in the task `loopTask`.
#include "Arduino.h"
#include "scheduler.h"
#include "wire.h"

int main() {
  board::watch_for_signals();
  wire::open();
  board::run_main([] {
    setup();
    wire::send(wire::READY, "", 0);
    for (;;) {
      board::polled_clock("loop()");
      loop();
    }
  });
}
