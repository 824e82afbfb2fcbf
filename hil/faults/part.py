"""The parts of a hand and of what is around it that an owner can replace, mend or leave."""

from __future__ import annotations

from enum import Enum


class Part(Enum):
    """Where a fault sits. A servo and a digit are those of one channel, the others of the whole hand."""

    COMPUTER = "this computer and its program"
    DRIVER = "the driver or its actuation map"
    USB = "USB cable and hub"
    BOARD = "board and its firmware"
    SUPPLY = "power supply and its wires"
    BUS = "plugs of the servo bus"
    SERVO = "servo"
    """Motor, gear, encoder, current sensor, and the settings in its registers."""
    DIGIT = "digit"
    """Cable, spring, joint and stop, and what touches it."""
    SETUP = "set-up"
    """Homing, the named firmware or side, something held, a glove, neighbours that touch."""
