// Part of arduino-esp32 used by firmware for the hand, on the emulated board. Supported functions act as on the chip;
// others do not compile, or stop the program with a message.
#pragma once

#define AERO_EMULATED_BOARD 1

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "esp_system.h"
#include "freertos/FreeRTOS.h"
#include "freertos/queue.h"
#include "freertos/semphr.h"
#include "freertos/task.h"
#include "freertos/timers.h"
#include "print.h"
#include "serial.h"

using std::abs;
using std::max;
using std::min;
using byte = uint8_t;
using boolean = bool;
using word = unsigned int;

#define PI 3.1415926535897932384626433832795
#define HIGH 1
#define LOW 0
#define INPUT 0x01
#define OUTPUT 0x03
#define INPUT_PULLUP 0x05
#define LED_BUILTIN 21
#define IRAM_ATTR
#define constrain(x, low, high) ((x) < (low) ? (low) : ((x) > (high) ? (high) : (x)))
#define bitRead(value, bit) (((value) >> (bit)) & 1)
#define lowByte(w) ((uint8_t)((w) & 0xff))
#define highByte(w) ((uint8_t)((w) >> 8))

void setup();
void loop();

unsigned long millis();
unsigned long micros();
void delay(uint32_t milliseconds);            // ends with the n-th tick from now, after n-1 to n ms
void delayMicroseconds(uint32_t microseconds);
void yield();
long map(long x, long in_low, long in_high, long out_low, long out_high);

void pinMode(uint8_t pin, uint8_t mode);      // pins lead nowhere: a light may be switched,
void digitalWrite(uint8_t pin, uint8_t value);
int digitalRead(uint8_t pin);                 // and what would have to be read is missing
int analogRead(uint8_t pin);
void analogWrite(uint8_t pin, int value);
void randomSeed(unsigned long seed);          // a seeded sequence, the same at each run
long random(long below);
long random(long from, long below);
