"""Guard of a hand: thresholds, polling against them, and a slow opening at any end of the program."""

from aero.safety.guarded import GuardedHand
from aero.safety.interrupts import unwinding
from aero.safety.regions import Region
from aero.safety.standby import Standby
from aero.safety.stop import Health, LinkLostError, SafetyReason, SafetyStopError
from aero.safety.thresholds import Thresholds
from aero.safety.watchdog import WatchedClock

__all__ = [
    "GuardedHand",
    "Health",
    "LinkLostError",
    "Region",
    "SafetyReason",
    "SafetyStopError",
    "Standby",
    "Thresholds",
    "WatchedClock",
    "unwinding",
]
