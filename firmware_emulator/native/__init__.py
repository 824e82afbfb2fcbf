"""Real firmware on the emulated hand: its C++ source compiled for this machine, on a board in virtual time."""
