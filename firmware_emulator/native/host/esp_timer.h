// The chip's microsecond counter; its timers are missing.
#pragma once

#include <cstdint>

int64_t esp_timer_get_time();
