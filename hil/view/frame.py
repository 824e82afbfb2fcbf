"""What the page shows of a hand at one instant, and how it travels to the page's process: one line of JSON each."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Literal

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
    hands_on: bool = False
    """Whether the page can do something to the hand, an emulated one that its program serves on a port."""
    asks: bool = False
    """Whether the page asks the person at the hand, and has a button that stops it."""


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
    window_percent: Floats = field(default_factory=unknown)
    """What the hand was last told, by whomever, (7,) % of the command window; known of an emulated hand only."""
    currents: Floats = field(default_factory=unknown)
    """Motor currents, (7,) A, magnitude."""
    temperatures: Floats = field(default_factory=unknown)
    """°C, (7,)."""
    tensions: Floats = field(default_factory=unknown)
    """Cable tensions, (7,) N; known of an emulated hand only."""
    loose: Floats = field(default_factory=unknown)
    """How much cable is loose, (7,) m; known of an emulated hand only."""


@dataclass(frozen=True)
class Note:
    """Something worth a line, at a time of the hand."""

    t: float
    text: str
    severity: Severity = "info"


@dataclass(frozen=True)
class Verdicts:
    """What was found so far; replaces what was shown before."""

    passed: int
    """Checks within their limits."""
    failed: tuple[str, ...]
    """One sentence for each check that is not."""


@dataclass(frozen=True)
class Asked:
    """A question to the person at the hand; replaces the one before."""

    number: int
    """Of the question, from 1; 0 where nothing is asked at present."""
    text: str = ""
    labels: tuple[str, ...] = ()
    """Of the answers to choose from; none for free text."""


@dataclass(frozen=True)
class CaseStands:
    """How a case stands; replaces what was shown before."""

    done: tuple[str, ...] = ()
    """The steps so far, each with its outcome."""
    do: str = ""
    """What the next step is; empty once the case is closed."""
    why: str = ""
    minutes: float = 0.0
    tool: str = ""
    channels: tuple[int, ...] = ()
    """Digits to be touched."""
    conclusion: str = ""
    """Empty while the case is open."""


@dataclass(frozen=True)
class Moving:
    """What is about to move, and how far it is."""

    text: str = ""
    """Channels, time, and what stops it; empty for the text before."""
    part: float = 0.0
    """Finished part, 0 to 1."""
    doing: str = ""
    left_s: float = 0.0


@dataclass(frozen=True)
class Told:
    """A line for the person at the hand."""

    text: str


@dataclass(frozen=True)
class ViewEnd:
    """Nothing more comes."""

    stay: bool
    """Whether the page stays until a browser has looked at it."""


CaseMessage = Asked | CaseStands | Moving | Told
Message = ViewFrame | Note | Verdicts | CaseMessage | ViewEnd
_KINDS: dict[str, Callable[..., Message]] = {
    one.__name__: one for one in (ViewFrame, Note, Verdicts, Asked, CaseStands, Moving, Told, ViewEnd)
}
STOP = "stop"
"""Words of the button that stops the hand."""
ANSWER = "answer"
"""Begins the words of an answer: number of the question and the answer, as the terminal takes it."""


DO = "do"
"""First word of the line in which the page's process says what a person does to the hand; a JSON string follows."""


def line(sent: Message) -> str:
    """Return a message as a line of JSON."""
    return json.dumps([type(sent).__name__, vars(sent)], default=np.ndarray.tolist) + "\n"


def message(text: str) -> Message:
    """Return what a line carries."""
    kind, fields = json.loads(text)
    if kind == ViewFrame.__name__:
        return ViewFrame(fields.pop("t"), **{name: np.array(value, float) for name, value in fields.items()})
    return _KINDS[kind](**{name: tuple(value) if isinstance(value, list) else value for name, value in fields.items()})
