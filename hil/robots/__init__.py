"""Other robots on a bus of Feetech servos: emulated, served, checked and set up, and their drivers tested."""
