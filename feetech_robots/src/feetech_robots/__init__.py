"""Robots of Feetech servos: emulation on a bus, servo checks and setup, and a test suite for bus drivers."""
