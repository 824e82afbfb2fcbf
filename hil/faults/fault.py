"""A fault: what may be wrong, as one object; and an injection of it, with its severity, place and time."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum, IntEnum

from aero.channels import Channel
from hil.faults.assembly import Active, HandAssembly

Inject = Callable[[HandAssembly, "Injection"], Active]
"""Puts a fault into a hand at its stage; raises ValueError for a hand that cannot have it."""
ALL = tuple(Channel)
STEPS = ("mild", "medium", "severe")
"""What may stand for a severity."""


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


class AssemblyStage(IntEnum):
    """When in the assembly of a hand a fault is injected."""

    BUILDING = 0
    """Before there are mechanics: it changes the unit, or which firmware there is."""
    SHAFTS = 1
    """Between servos and mechanics."""
    RUNNING = 2
    """Into the electronics, or into their link to the host."""


class FaultLayer(Enum):
    """What a fault is about. Its value is its name for people and the stage of its injection."""

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
        """Its name for people."""
        return self.value[0]

    @property
    def stage(self) -> AssemblyStage:
        """When its faults are injected."""
        return self.value[1]


@dataclass(frozen=True)
class Severity:
    """How much of a fault there may be."""

    unit: str
    steps: tuple[float, float, float]
    """Mild (near what a harness might just see), medium (the default), severe (plainly harmful)."""
    low: float = 0.0
    high: float = math.inf
    """Bounds; those of the catalogue are finite."""

    def __str__(self) -> str:
        """Return the three steps with their unit, for people."""
        return f"{', '.join(f'{step:g}' for step in self.steps)} {self.unit}"


def share(of: str, mild: float, medium: float, severe: float) -> Severity:
    """Return a severity from 0 to 1 that is a share of something."""
    return Severity(f"of {of}", (mild, medium, severe), 0.0, 1.0)


@dataclass(frozen=True)
class Fault:
    """Something that may be wrong."""

    name: str
    layer: FaultLayer
    part: Part
    """What an owner replaces, mends or changes when this is wrong."""
    words: str
    """What it is, for people."""
    inject: Inject
    channels: tuple[Channel, ...] = ()
    """Channels that it may sit on, the default first; empty for a fault of the whole hand."""
    severity: Severity | None = None
    """None for a fault that is there or not."""
    at_s: float = 0.0
    """When it begins where nothing is said, s."""
    later: bool = True
    """Whether it can begin on a running hand; else the hand is built with it."""
    excludes: str = ""
    """Two faults with the same word here cannot sit on one channel; its own name when left out."""
    alike: tuple[Part, ...] = ()
    """Other parts whose fault is the same to whoever does not open the hand."""

    def at(self, severity: float | None = None, channel: Channel | None = None, at_s: float | None = None) -> Injection:
        """Return an injection of this fault.

        Args:
            severity: the medium one when None.
            channel: the default one when None.
            at_s: the default time when None, s.

        Raises:
            ValueError: it cannot have this severity, sit there or begin then.
        """
        how_much = self.steps()[len(self.steps()) // 2] if severity is None else severity
        return Injection(
            self,
            float(how_much),
            self.channels[0] if channel is None and self.channels else channel,
            self.at_s if at_s is None else float(at_s),
        )

    def steps(self) -> tuple[float, ...]:
        """Return the severities that a campaign takes: mild, medium and severe, or 1 where it is there or not."""
        return (1.0,) if self.severity is None else self.severity.steps


@dataclass(frozen=True)
class Injection:
    """A fault, how much of it, where, and since when. `str` gives the text that `parse_fault` reads."""

    fault: Fault
    severity: float
    """In the unit of the fault; 1 for one that is there or not."""
    channel: Channel | None = None
    """Where it sits; None for a fault of the whole hand."""
    at_s: float = 0.0
    """When it begins, s after the target was opened; 0 for one that the hand was built with."""

    def __post_init__(self) -> None:
        fault, name = self.fault, self.fault.name
        bounds = (1.0, 1.0) if fault.severity is None else (fault.severity.low, fault.severity.high)
        if not (math.isfinite(self.severity) and bounds[0] <= self.severity <= bounds[1]):
            wanted = f"goes from {bounds[0]:g} to {bounds[1]:g} {self.unit}" if self.unit else "is there or not (1)"
            raise ValueError(f"the fault {name} {wanted}, not {self.severity:g}")
        if self.channel not in (fault.channels or (None,)):
            known = ", ".join(channel.label for channel in fault.channels)
            wanted = f"sits on {known}" if known else "is of the whole hand and has no channel"
            raise ValueError(f"the fault {name} {wanted}, not {self.channel and self.channel.label!r}")
        if not (math.isfinite(self.at_s) and self.at_s >= 0.0):
            raise ValueError(f"the fault {name} begins at a time from 0 s on, not {self.at_s:g}")
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
        """The part that is at fault, then those whose fault is the same to whoever does not open the hand."""
        return self.fault.part, *self.fault.alike

    @property
    def unit(self) -> str:
        """Unit of the severity; empty for a fault that is there or not."""
        return "" if self.fault.severity is None else self.fault.severity.unit

    @property
    def where(self) -> Channel:
        """The channel of a fault that sits on one."""
        assert self.channel is not None, f"{self.name} sits on no channel"
        return self.channel

    @property
    def rivals(self) -> tuple[str, Channel | None]:
        """What no two injections of one hand have in common."""
        return self.fault.excludes or self.name, self.channel

    def __str__(self) -> str:
        """Return `NAME[:CHANNEL]=SEVERITY[@SECONDS]`."""
        where = "" if self.channel is None else f":{self.channel.label}"
        when = f"@{self.at_s!r}" if self.at_s else ""
        return f"{self.name}{where}={self.severity!r}{when}"
