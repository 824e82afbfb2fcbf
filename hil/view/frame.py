"""What the page shows of a hand at one instant, and how it travels to the page's process: one line of JSON each."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from typing import Any, Literal, Self

import numpy as np
from numpy.typing import NDArray

from aero.channels import Channel, Joint
from model.geometry import Side

Floats = NDArray[np.float64]
Severity = Literal["info", "warning", "error"]


def unknown(size: int = len(Channel)) -> Floats:
    """Return numbers that nobody knows, (size,) NaN."""
    return np.full(size, np.nan)


@dataclass(frozen=True)
class Heading:
    """What stands above the page, and which hand is drawn."""

    title: str
    """One line: which hand, by which command."""
    side: Side
    live: bool
    """Whether frames come while it is looked at."""


@dataclass(frozen=True)
class ViewFrame:
    """One instant. Arrays over channels are in command order; NaN stands for what is not known."""

    t: float
    """Time of the hand, s."""
    joints: Floats
    """Posture, (16,) rad, in the order of `Joint`."""
    commanded_joints: Floats = field(default_factory=lambda: unknown(len(Joint)))
    """Posture at the shaft angles that are asked for, (16,) rad: seven cables do not tell sixteen joints, so it is the
    present posture moved by what the actuation map makes of the rest of the way."""
    commanded: Floats = field(default_factory=unknown)
    """Shaft angles that are asked for, (7,) rad."""
    measured: Floats = field(default_factory=unknown)
    """Shaft angles that the encoders say, (7,) rad."""
    currents: Floats = field(default_factory=unknown)
    """Motor currents, (7,) A, magnitude."""
    temperatures: Floats = field(default_factory=unknown)
    """°C, (7,)."""
    tensions: Floats = field(default_factory=unknown)
    """Cable tensions, (7,) N; known of an emulated hand only."""
    loose: Floats = field(default_factory=unknown)
    """How much cable is loose, (7,) m; known of an emulated hand only."""

    def line(self) -> str:
        """Return this frame as a line of JSON."""
        body = {name: value.tolist() if name != "t" else value for name, value in vars(self).items()}
        return _line("frame", body)

    @classmethod
    def of(cls, body: dict[str, Any]) -> Self:
        """Return the frame that a line carries."""
        return cls(body.pop("t"), **{name: np.array(value, float) for name, value in body.items()})


@dataclass(frozen=True)
class Note:
    """Something worth a line, at a time of the hand."""

    t: float
    text: str
    severity: Severity = "info"

    def line(self) -> str:
        """Return this note as a line of JSON."""
        return _line("note", asdict(self))


@dataclass(frozen=True)
class Verdicts:
    """What was found so far; replaces what was shown before."""

    passed: int
    """Checks within their limits."""
    failed: tuple[str, ...]
    """One sentence for each check that is not."""

    def line(self) -> str:
        """Return these verdicts as a line of JSON."""
        return _line("verdicts", asdict(self))


@dataclass(frozen=True)
class ViewEnd:
    """Nothing more comes."""

    stay: bool
    """Whether the page stays until a browser has looked at it."""

    def line(self) -> str:
        """Return this end as a line of JSON."""
        return _line("end", asdict(self))


Message = ViewFrame | Note | Verdicts | ViewEnd


def message(line: str) -> Message:
    """Return what a line carries."""
    ((kind, body),) = json.loads(line).items()
    if kind == "verdicts":
        return Verdicts(body["passed"], tuple(body["failed"]))
    read: dict[str, Callable[..., Message]] = {"note": Note, "end": ViewEnd}
    return ViewFrame.of(body) if kind == "frame" else read[kind](**body)


def _line(kind: str, body: dict[str, Any]) -> str:
    return json.dumps({kind: body}) + "\n"
