"""Faults as objects, and injections of faults with severity, channel and start time."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum, IntEnum

from aero.channels import Channel
from hil.emulated.faults.assembly import Active, HandAssembly
from hil.verdict.part import Part

Inject = Callable[[HandAssembly, "Injection"], Active]
"""Injects a fault into a hand at the fault's stage; raises ValueError if the hand cannot have the fault."""
ALL = tuple(Channel)
STEPS = ("mild", "medium", "severe")
"""Names of the three severities."""


class AssemblyStage(IntEnum):
    """Stage of a hand's assembly at which a fault is injected."""

    BUILDING = 0
    """Before the mechanics are built: the fault changes the unit or the firmware."""
    SHAFTS = 1
    """Between servos and mechanics."""
    RUNNING = 2
    """In the electronics, or in their link to the host."""


class FaultLayer(Enum):
    """Layer of a hand at which a fault acts; the value is a display name and an injection stage."""

    CABLE = "cable", AssemblyStage.BUILDING
    JOINT = "joint", AssemblyStage.BUILDING
    GEAR = "gear", AssemblyStage.BUILDING
    FIRMWARE = "firmware", AssemblyStage.BUILDING
    WINDING = "winding", AssemblyStage.SHAFTS
    MOTOR = "motor", AssemblyStage.SHAFTS
    ENCODER = "encoder", AssemblyStage.SHAFTS
    SUPPLY = "supply", AssemblyStage.SHAFTS
    SERVO = "servo", AssemblyStage.RUNNING
    BUS = "bus", AssemblyStage.RUNNING
    BOARD = "board", AssemblyStage.RUNNING
    LINK = "link", AssemblyStage.RUNNING
    HOST = "host", AssemblyStage.RUNNING

    @property
    def label(self) -> str:
        """Display name of the layer."""
        return self.value[0]

    @property
    def stage(self) -> AssemblyStage:
        """Stage at which faults of the layer are injected."""
        return self.value[1]


@dataclass(frozen=True)
class Severity:
    """Severity scale of a fault: unit, three steps, bounds."""

    unit: str
    steps: tuple[float, float, float]
    """Mild (near the detection limit of a harness), medium (the default), severe (plainly harmful)."""
    low: float = 0.0
    high: float = math.inf
    """Upper bound; finite for every fault of the catalogue."""

    def __str__(self) -> str:
        """Return the three steps with their unit, as text for display."""
        return f"{', '.join(f'{step:g}' for step in self.steps)} {self.unit}"


def share(of: str, mild: float, medium: float, severe: float) -> Severity:
    """Return the severity scale of a fraction of `of`, 0 to 1."""
    return Severity(f"of {of}", (mild, medium, severe), 0.0, 1.0)


@dataclass(frozen=True)
class Fault:
    """Fault type of the catalogue, without severity, channel or time of an injection."""

    name: str
    layer: FaultLayer
    part: Part
    """Part to be replaced, repaired or corrected by the owner."""
    words: str
    inject: Inject
    channels: tuple[Channel, ...] = ()
    """Candidate channels, the default first; empty for a fault of the whole hand."""
    severity: Severity | None = None
    """Severity scale, or None for a fault that is either present or absent."""
    at_s: float = 0.0
    """Default start time, s."""
    later: bool = True
    """True for a fault that can begin on a running hand, False for a fault that is built in."""
    excludes: str = ""
    """Exclusion group, the fault's name if empty; two faults of one group cannot share a channel."""
    alike: tuple[Part, ...] = ()
    """Other parts whose fault looks identical from outside the hand."""

    def at(self, severity: float | None = None, channel: Channel | None = None, at_s: float | None = None) -> Injection:
        """Return an injection of this fault.

        Args:
            severity: medium if None.
            channel: the fault's default channel if None.
            at_s: start time, s; the fault's default if None.

        Raises:
            ValueError: severity, channel or start time is invalid for the fault.
        """
        how_much = self.steps()[len(self.steps()) // 2] if severity is None else severity
        return Injection(
            self,
            float(how_much),
            self.channels[0] if channel is None and self.channels else channel,
            self.at_s if at_s is None else float(at_s),
        )

    def steps(self) -> tuple[float, ...]:
        """Return the severities of a campaign: mild, medium and severe, or 1 for a fault without a scale."""
        return (1.0,) if self.severity is None else self.severity.steps


@dataclass(frozen=True)
class Injection:
    """Fault with severity, channel and start time. `str` returns the text that `parse_fault` reads."""

    fault: Fault
    severity: float
    """Severity in the fault's unit; 1 for a fault without a scale."""
    channel: Channel | None = None
    """Faulty channel; None for a fault of the whole hand."""
    at_s: float = 0.0
    """Start time, s after the opening of the target; 0 for a built-in fault."""

    def __post_init__(self) -> None:
        fault, name = self.fault, self.fault.name
        bounds = (1.0, 1.0) if fault.severity is None else (fault.severity.low, fault.severity.high)
        if not (math.isfinite(self.severity) and bounds[0] <= self.severity <= bounds[1]):
            wanted = f"goes from {bounds[0]:g} to {bounds[1]:g} {self.unit}" if self.unit else "has no severity (1)"
            raise ValueError(f"the fault {name} {wanted}, not {self.severity:g}")
        if self.channel not in (fault.channels or (None,)):
            known = ", ".join(channel.label for channel in fault.channels)
            wanted = f"sits on {known}" if known else "is of the whole hand and has no channel"
            raise ValueError(f"the fault {name} {wanted}, not {self.channel and self.channel.label!r}")
        if not (math.isfinite(self.at_s) and self.at_s >= 0.0):
            raise ValueError(f"the fault {name} needs a start time of at least 0 s, not {self.at_s:g}")
        if self.at_s and not fault.later:
            raise ValueError(f"the fault {name} is built in and cannot begin later; leave out @{self.at_s:g}")

    @property
    def name(self) -> str:
        """The fault's name."""
        return self.fault.name

    @property
    def part(self) -> Part:
        """The part that is at fault."""
        return self.fault.part

    @property
    def parts(self) -> tuple[Part, ...]:
        """The part at fault, then the parts whose fault looks identical from outside the hand."""
        return self.fault.part, *self.fault.alike

    @property
    def unit(self) -> str:
        """Unit of the severity; empty for a fault without a scale."""
        return "" if self.fault.severity is None else self.fault.severity.unit

    @property
    def where(self) -> Channel:
        """Faulty channel, asserted to be set."""
        assert self.channel is not None, f"{self.name} sits on no channel"
        return self.channel

    @property
    def rivals(self) -> tuple[str, Channel | None]:
        """Exclusion group and channel; no two injections of one hand may have an equal pair."""
        return self.fault.excludes or self.name, self.channel

    def __str__(self) -> str:
        """Return `NAME[:CHANNEL]=SEVERITY[@SECONDS]`."""
        where = "" if self.channel is None else f":{self.channel.label}"
        when = f"@{self.at_s!r}" if self.at_s else ""
        return f"{self.name}{where}={self.severity!r}{when}"
