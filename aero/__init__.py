"""Library for an Aero Hand Open, real or emulated: channels, actuation map, guarded driver.

Depends on NumPy and pyserial only; `open_hand` opens a hand for motion. Public names are imported lazily: the command
line reads `aero.firmware` for its options and should not load NumPy to print its help.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from aero.actuation import UNSHIFTED, ActuationMap, CommandWindow
    from aero.channels import CABLES, FINGERS, JOINT_BOX_RAD, OBSERVATION_ORDER, Channel, Joint
    from aero.clock import Clock, Deadline, WallClock
    from aero.driver import AeroHand
    from aero.hand import Hand, open_hand
    from aero.transport import Transport

_NAMES = {
    "aero.actuation": ("UNSHIFTED", "ActuationMap", "CommandWindow"),
    "aero.channels": ("CABLES", "FINGERS", "JOINT_BOX_RAD", "OBSERVATION_ORDER", "Channel", "Joint"),
    "aero.clock": ("Clock", "Deadline", "WallClock"),
    "aero.driver": ("AeroHand",),
    "aero.hand": ("Hand", "open_hand"),
    "aero.transport": ("Transport",),
}
"""Module to the public names that it defines."""
_HOMES = {name: module for module, names in _NAMES.items() for name in names}

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


def __getattr__(name: str) -> object:
    """Import a public name from its module."""
    if name in _HOMES:
        return getattr(import_module(_HOMES[name]), name)
    raise AttributeError(f"module 'aero' has no attribute {name!r}")


def __dir__() -> list[str]:
    """List the public names, imported or not."""
    return sorted({*globals(), *_HOMES})
