"""Parts that a diagnosis names, and that a fault of an emulated hand sits in."""

from enum import Enum


class Part(Enum):
    """Component at fault: one channel's for SERVO and DIGIT, the whole hand's otherwise."""

    COMPUTER = "this computer and its program"
    DRIVER = "the driver or its actuation map"
    USB = "USB cable and hub"
    BOARD = "board and its firmware"
    SUPPLY = "power supply and its wires"
    BUS = "plugs of the servo bus"
    SERVO = "servo"
    """Motor, gear, encoder, current sensor, and the settings in its registers."""
    DIGIT = "digit"
    """Cable, spring, joint, end stop, and objects in contact with the digit."""
    SETUP = "set-up"
    """Homing, the declared firmware or side, a held object, a glove, neighbours in contact."""
