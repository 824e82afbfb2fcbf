"""Safety of a hand that a program moves: thresholds, the watch over them, and a slow opening however it ends."""

from aero.safety.guarded import GuardedHand, Health
from aero.safety.interrupts import unwinding
from aero.safety.lifeline import lifeline
from aero.safety.stop import SafetyStopError
from aero.safety.thresholds import Settings, Thresholds
from aero.safety.watched_clock import WatchedClock

__all__ = [
    "GuardedHand",
    "Health",
    "SafetyStopError",
    "Settings",
    "Thresholds",
    "WatchedClock",
    "lifeline",
    "unwinding",
]
