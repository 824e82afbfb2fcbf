// Host board as one compilation unit, which compiles three times as fast as separate units.
#include "arduino.cpp"
#include "freertos.cpp"
#include "main.cpp"
#include "scheduler.cpp"
#include "serial.cpp"
#include "storage.cpp"
#include "wire.cpp"
