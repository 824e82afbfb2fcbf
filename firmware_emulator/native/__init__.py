"""Real firmware on the emulated hand: C++ source compiled for this machine, run in virtual time."""
