"""Messages to the page's process, one line of JSON each: frames of a hand, events, findings, questions."""

import json
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from aero.channels import Channel, Joint
from aero.floats import Floats
from aero.side import Side
from hil.recordings.recording import Severity


def unknown(size: int = len(Channel)) -> Floats:
    """Return an array of unknown values, (size,) NaN."""
    return np.full(size, np.nan)


class FaultOffered(NamedTuple):
    """Fault in the menu of an emulated hand."""

    name: str
    words: str
    severities: str
    """Severities with their unit, as text for display."""
    channels: tuple[str, ...] = ()
    """Labels of the candidate channels; empty for a fault of the whole hand."""
    steps: tuple[str, ...] = ()
    """Names of the severities; empty for a fault without a scale."""


@dataclass(frozen=True)
class Heading:
    """Title and features of the page."""

    title: str
    """Title line: hand and command."""
    side: Side
    live: bool
    """True for a live hand, False for a recording."""
    hands_on: bool = False
    """True to show the controls of an emulated hand on a port."""
    faults: tuple[FaultOffered, ...] = ()
    """Faults that the controls offer."""
    asks: bool = False
    """True to show questions to the person at the hand, and a Stop button."""

    def __post_init__(self) -> None:
        # JSON, which brings the heading to the page's process, has lists only
        object.__setattr__(self, "faults", tuple(FaultOffered(*one) for one in self.faults))


@dataclass(frozen=True)
class ViewFrame:
    """State of a hand at one instant. Arrays over channels are in command order; NaN marks unknown values."""

    t: float
    """Time of the hand, s."""
    joints: Floats
    """Posture, (16,) rad, in the order of `Joint`."""
    commanded_joints: Floats = field(default_factory=lambda: unknown(len(Joint)))
    """Posture at the commanded shaft angles, (16,) rad. Seven cables do not determine sixteen joints, so ground truth
    is extrapolated: present posture plus the actuation map's change from measured to commanded angles."""
    commanded: Floats = field(default_factory=unknown)
    """Commanded shaft angles, (7,) rad."""
    measured: Floats = field(default_factory=unknown)
    """Shaft angles by the encoders, (7,) rad."""
    window_percent: Floats = field(default_factory=unknown)
    """Last command from any program, (7,) % of the command window; known for an emulated hand only."""
    currents: Floats = field(default_factory=unknown)
    """Motor currents, (7,) A, magnitude."""
    temperatures: Floats = field(default_factory=unknown)
    """Servo temperatures, (7,) °C."""
    tensions: Floats = field(default_factory=unknown)
    """Cable tensions, (7,) N; known for an emulated hand only."""
    loose: Floats = field(default_factory=unknown)
    """Cable slack, (7,) m; known for an emulated hand only."""


@dataclass(frozen=True)
class Note:
    """Event at a time of the hand."""

    t: float
    text: str
    severity: Severity = "info"


@dataclass(frozen=True)
class Verdicts:
    """Findings so far; replaces the earlier message."""

    passed: int
    """Number of checks within their limits."""
    failed: tuple[str, ...]


@dataclass(frozen=True)
class Asked:
    """Question to the person at the hand; replaces the earlier question."""

    number: int
    """Number of the question, from 1; 0 withdraws the question."""
    text: str = ""
    labels: tuple[str, ...] = ()
    """Labels of the possible answers; empty for free text."""


@dataclass(frozen=True)
class CaseStands:
    """Status of a case; replaces the earlier message."""

    done: tuple[str, ...] = ()
    """Finished steps with their outcomes."""
    do: str = ""
    """Next step; empty in a closed case."""
    why: str = ""
    minutes: float = 0.0
    tool: str = ""
    channels: tuple[int, ...] = ()
    conclusion: str = ""


@dataclass(frozen=True)
class Moving:
    """Announcement or progress of a motion."""

    text: str = ""
    """Channels, duration and stop conditions; empty keeps the earlier text."""
    part: float = 0.0
    """Finished fraction, 0 to 1."""
    doing: str = ""
    left_s: float = 0.0


@dataclass(frozen=True)
class Told:
    """Text line for the person at the hand."""

    text: str


@dataclass(frozen=True)
class ViewEnd:
    """Last message."""

    stay: bool
    """True to serve the page until a browser has opened and closed it."""


CaseMessage = Asked | CaseStands | Moving | Told
Message = ViewFrame | Note | Verdicts | CaseMessage | ViewEnd
_KINDS: dict[str, Callable[..., Message]] = {
    one.__name__: one for one in (ViewFrame, Note, Verdicts, Asked, CaseStands, Moving, Told, ViewEnd)
}
STOP = "stop"
"""Text of the Stop button's command."""
ANSWER = "answer"
"""First word of an answer; the question's number and the answer as typed on a terminal follow."""


DO = "do"
"""First word of a line from the page's process with a user command; a JSON string follows."""


def line(sent: Message) -> str:
    """Return a message as a line of JSON."""
    return json.dumps([type(sent).__name__, vars(sent)], default=np.ndarray.tolist) + "\n"


def message(text: str) -> Message:
    """Parse a message from a line of JSON."""
    kind, fields = json.loads(text)
    if kind == ViewFrame.__name__:
        return ViewFrame(fields.pop("t"), **{name: np.array(value, float) for name, value in fields.items()})
    return _KINDS[kind](**{name: tuple(value) if isinstance(value, list) else value for name, value in fields.items()})
