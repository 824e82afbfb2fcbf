"""`aero-hil servos check`: is this bus of Feetech servos healthy, and what to do where it is not."""
