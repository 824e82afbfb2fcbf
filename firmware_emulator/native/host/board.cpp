// The whole host board as one unit, which compiles three times as fast as its parts.
#include "arduino.cpp"
#include "freertos.cpp"
#include "main.cpp"
#include "scheduler.cpp"
#include "serial.cpp"
#include "storage.cpp"
#include "wire.cpp"
