"""What runs against an Aero Hand Open, real or emulated: channels, actuation map, guarded driver.

NumPy and pyserial only. `open_hand` is the way to a hand that moves.
"""

from aero.actuation import UNSHIFTED, ActuationMap, CommandWindow
from aero.channels import CABLES, FINGERS, JOINT_BOX_RAD, OBSERVATION_ORDER, Channel, Joint
from aero.clock import Clock, Deadline, WallClock
from aero.driver import AeroHand
from aero.guarded_port import open_hand
from aero.hand import Hand
from aero.transport import Transport

__all__ = [
    "CABLES",
    "FINGERS",
    "JOINT_BOX_RAD",
    "OBSERVATION_ORDER",
    "UNSHIFTED",
    "ActuationMap",
    "AeroHand",
    "Channel",
    "Clock",
    "CommandWindow",
    "Deadline",
    "Hand",
    "Joint",
    "Transport",
    "WallClock",
    "open_hand",
]
