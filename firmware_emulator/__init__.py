"""The hand's electronics in software: ESP32-S3 firmware, Feetech servo bus, servos, links. NumPy and pyserial only."""
