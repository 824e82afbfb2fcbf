"""The ESP32-S3 firmware of the Aero Hand Open: host frames on one side, the servo library on the other."""
