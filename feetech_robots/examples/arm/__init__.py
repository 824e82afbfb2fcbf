"""A six-joint arm of bus servos as an example of `aero-hil emulate-bus`; see docs/emulate_bus.md."""
