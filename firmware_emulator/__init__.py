"""Emulated hand electronics: ESP32-S3 firmware, Feetech servo bus, servos, links. Needs no physics engine."""
