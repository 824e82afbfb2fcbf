"""Safety of a hand that a program moves: thresholds, the watch over them, and a slow opening however it ends."""

from aero.safety.firmware import usual_settings
from aero.safety.guarded import GuardedHand
from aero.safety.interrupts import unwinding
from aero.safety.standby import Standby
from aero.safety.state import Health
from aero.safety.stop import LinkLostError, SafetyStopError
from aero.safety.thresholds import ServoSettings, Thresholds
from aero.safety.watched_clock import WatchedClock

__all__ = [
    "GuardedHand",
    "Health",
    "LinkLostError",
    "SafetyStopError",
    "ServoSettings",
    "Standby",
    "Thresholds",
    "WatchedClock",
    "unwinding",
    "usual_settings",
]
