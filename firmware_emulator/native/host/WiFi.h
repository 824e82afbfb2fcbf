// No radio: any use stops the program with a message.
#pragma once

#include "scheduler.h"

#define WIFI_STA 1
#define WIFI_AP 2
#define WL_CONNECTED 3

struct WiFiClass {
  bool mode(int) { board::missing("WiFi.mode()"); }
  int begin(const char*, const char* = nullptr) { board::missing("WiFi.begin()"); }
  bool softAP(const char*, const char* = nullptr) { board::missing("WiFi.softAP()"); }
  int status() { board::missing("WiFi.status()"); }
};
inline WiFiClass WiFi;
