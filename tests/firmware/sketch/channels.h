#pragma once

#define CHANNELS 7
