"""What is said of a run that failed: where something is wrong, what kind of effect it has, and which cause fits."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum

from aero.channels import Channel
from hil.faults.fault import Fault


class Place(Enum):
    """Where something is wrong; the values are what people read."""

    HOST_AND_DRIVER = "host and driver"
    """The program, its driver or its actuation map."""
    LINK = "link"
    """Cable, adapter and port between host and board."""
    BOARD = "board"
    """The ESP32 and its firmware."""
    SUPPLY = "supply"
    ONE_CHANNEL = "one channel"
    """One servo, its cable and its digit."""
    SEVERAL_CHANNELS = "several channels"
    """Servos, cables or digits that share a mistake, and the bus that they share."""


class Effect(Enum):
    """What something wrong does; the values are what people read."""

    NOTHING_MOVES = "nothing moves"
    TOO_LITTLE_TORQUE = "too little torque"
    TOO_MUCH_FRICTION = "too much friction"
    ELASTIC = "a spring or a cable pulls otherwise"
    LOST_MOTION = "motion is lost or ends elsewhere"
    SENSOR = "a sensor reads wrongly"
    HEAT = "too hot"
    TIMING = "late or irregular"
    LOST_BYTES = "bytes are lost or altered"
    RESTART = "the board restarts or stops"
    VERSION = "another version"
    WIRING = "exchanged or reversed"
    SETTINGS = "settings"
    COMMANDS = "other commands than were meant"


@dataclass(frozen=True)
class Whereabouts:
    """One place, and how likely something is wrong there."""

    place: Place
    channel: Channel | None
    """The channel, for `Place.ONE_CHANNEL`; None for every other place."""
    probability: float

    @property
    def sentence(self) -> str:
        """Where, in words."""
        return self.place.value if self.channel is None else f"{self.channel.label} ({self.place.value})"


@dataclass(frozen=True)
class LikelyEffect:
    """One kind of effect, and how likely it is."""

    effect: Effect
    probability: float


@dataclass(frozen=True)
class Explanation:
    """One cause that is known, where it sits, and how likely it is."""

    cause: str
    """Name of a kind of fault, or of a group that looks alike on this wire."""
    channel: Channel | None
    """Where; None for the whole hand."""
    probability: float
    fault: Fault | None
    """The known fault that is most like the run; None where none is learned."""
    meaning: str = ""
    """What it is, for people."""
    next_look: str = ""
    """What would tell it from the next likely one."""

    @property
    def sentence(self) -> str:
        """The cause in one sentence."""
        where = "the hand" if self.channel is None else self.channel.label
        return f"{self.probability:.0%} {self.cause} ({where}): {self.meaning}"


@dataclass(frozen=True)
class Diagnosis:
    """What is said of a run that failed, from the coarse to the fine; each list has the likeliest first.

    The probabilities of a list add up to one, or to less: the rest is for what is not listed and what nobody knows.
    """

    where: tuple[Whereabouts, ...] = ()
    effects: tuple[LikelyEffect, ...] = ()
    causes: tuple[Explanation, ...] = ()
    shown: tuple[str, ...] = ()
    """Causes that the run does not contradict, by name; empty when it is unlike anything known."""
    off: tuple[tuple[str, float], ...] = ()
    """Channels, by label, and `hand`, whose readings are off, with how far; the furthest first."""

    @property
    def unlike_anything_known(self) -> bool:
        """Whether something is wrong, and no known cause fits it."""
        return bool(self.where) and not self.shown

    @property
    def explanations(self) -> Iterator[Explanation]:
        """The causes that fit, the likeliest first."""
        return (cause for cause in self.causes if cause.cause in self.shown)


HEALTHY = Diagnosis()
"""Of a run in which nothing is wrong."""
