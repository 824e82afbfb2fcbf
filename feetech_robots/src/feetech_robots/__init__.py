"""Robots of Feetech servos: emulated on a bus, checked and set up, and a suite for drivers of that bus."""
