"""One fault, and what is known about its kind."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from aero.channels import CABLES, FINGERS, Channel

FaultLayer = Literal["hand", "servo", "bus", "firmware", "link", "host"]
ALL = tuple(Channel)
SWITCH = (1.0, 1.0, 1.0)
"""Severities of a fault that is there or not."""
ONCE = (1.0, 1.0)
SHARE = (0.0, 1.0)
"""Bounds of a severity."""
HOMED = "homing starts at the closed stop and finds the zero anew: no reading changes, and the hand works"
"""Reason why a homed hand shows no wrong zero."""
RUBBING = "healthy gears differ by a factor of four, which hides what a mild one adds"
"""Reason why mild friction is not seen."""

__all__ = [
    "ALL",
    "CABLES",
    "FINGERS",
    "HOMED",
    "ONCE",
    "RUBBING",
    "SHARE",
    "SWITCH",
    "Fault",
    "FaultLayer",
    "Kind",
    "quantity",
]


def quantity(severity: float, unit: str) -> str:
    """Return a severity for people: a share in per cent, a multiple of a step (`6.5 mA`) worked out."""
    step, _, of_step = unit.partition(" ")
    if step.replace(".", "").isdigit():
        return f"{severity * float(step):g} {of_step}"
    if step == "of" and severity <= 1.0:
        return f"{100 * severity:g} % {unit}"
    return f"a factor of {severity:g}" if unit == "factor" else f"{severity:g} {unit}"


@dataclass(frozen=True)
class Fault:
    """Something that is wrong, where, how much, and since when. `str` gives the text that `parse_fault` reads."""

    name: str
    """A key of `CATALOGUE`."""
    severity: float
    """In the unit of its kind; 1 for a fault that is there or not."""
    channel: Channel | None = None
    """Where it sits; None for a fault of the whole hand."""
    at_s: float = 0.0
    """When it begins, s after the target was opened; 0 for one that the hand was built with."""

    def __str__(self) -> str:
        """Return `NAME[:CHANNEL]=SEVERITY[@SECONDS]`."""
        where = "" if self.channel is None else f":{self.channel.label}"
        when = f"@{self.at_s!r}" if self.at_s else ""
        return f"{self.name}{where}={self.severity!r}{when}"


@dataclass(frozen=True)
class Kind:
    """What all faults of one name have in common: a row of the catalogue."""

    name: str
    layer: FaultLayer
    ids: tuple[str, ...]
    """Reported faults that it stands for, by layer: A host link, B firmware, C servo bus, D hand, E host."""
    unit: str
    """Unit of the severity; empty for a fault that is there or not."""
    severities: tuple[float, float, float]
    """Mild (near what a harness might just see), medium, severe (plainly harmful)."""
    meaning: str
    """What it is, for people."""
    subjects: tuple[Channel, ...] = ()
    """Channels that it may sit on, the default first; empty for a fault of the whole hand."""
    cause: str = ""
    """Group of faults that look alike on this wire and need the same inspection; its own name when left out."""
    bounds: tuple[float, float] = (0.0, math.inf)
    """Smallest and largest severity."""
    at_s: float = 0.0
    """When it begins where nothing is said, s."""
    later: bool = True
    """Whether it can begin at a time; else the hand is built with it."""
    excludes: str = ""
    """Two faults with the same word here cannot sit on one channel."""
    visible: bool = True
    """Whether an encoder, a current or the bytes of the link can show it at all."""
    reason: str = ""
    """Why a validation of a homed hand cannot see it, or only from some severity on."""

    def __post_init__(self) -> None:
        if not self.cause:
            object.__setattr__(self, "cause", self.name)

    @property
    def is_switch(self) -> bool:
        """Whether it has no severity."""
        return self.severities == SWITCH

    def fault(self, severity: float | None = None, channel: Channel | None = None, at_s: float | None = None) -> Fault:
        """Return a checked fault of this kind.

        Args:
            severity: the medium one when None.
            channel: the default one when None.
            at_s: the default time when None, s.

        Raises:
            ValueError: it cannot have this severity, sit there or begin then.
        """
        where = channel if channel is not None or not self.subjects else self.subjects[0]
        how_much = self.severities[1] if severity is None else severity
        return self.checked(Fault(self.name, float(how_much), where, self.at_s if at_s is None else float(at_s)))

    def checked(self, fault: Fault) -> Fault:
        """Return `fault`, on its default channel where it has none.

        Raises:
            ValueError: it cannot have this severity, sit there or begin then.
        """
        if fault.channel is None and self.subjects:
            fault = Fault(fault.name, fault.severity, self.subjects[0], fault.at_s)
        low, high = self.bounds
        if not (math.isfinite(fault.severity) and low <= fault.severity <= high):
            wanted = "is there or not (1)" if self.is_switch else f"goes from {low:g} to {high:g} {self.unit}"
            raise ValueError(f"the fault {self.name} {wanted}, not {fault.severity:g}")
        if fault.channel not in (self.subjects or (None,)):
            known = ", ".join(channel.label for channel in self.subjects)
            wanted = f"sits on {known}" if known else "is of the whole hand and has no channel"
            raise ValueError(f"the fault {self.name} {wanted}, not {fault.channel and fault.channel.label!r}")
        if not (math.isfinite(fault.at_s) and fault.at_s >= 0.0):
            raise ValueError(f"the fault {self.name} begins at a time from 0 s on, not {fault.at_s:g}")
        if fault.at_s and not self.later:
            raise ValueError(f"the fault {self.name} is built in and cannot begin later; leave out @{fault.at_s:g}")
        return fault
