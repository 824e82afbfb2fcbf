"""Faults of a hand, its servos, its board and its link, as plain objects.

`parse_fault("encoder_scale:index=1.05@20")` returns an injection, `CATALOGUE` lists all faults, and
`hil.emulate(faults=...)` injects faults into an emulated hand.
"""

from aero_hil import hidden

if _line := hidden():
    raise ImportError(_line)

from hil.emulated.faults.catalogue import CATALOGUE, parse_fault
from hil.emulated.faults.fault import Fault, Injection
from hil.emulated.faults.schedule import Schedule

__all__ = ["CATALOGUE", "Fault", "Injection", "Schedule", "parse_fault"]
