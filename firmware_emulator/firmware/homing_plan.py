"""Homing as data: what each version does to each channel, step by step.

Sources: aero-open-firmware 46bc858 and d7bd82e, `Homing.cpp`; aero-hand-open 890c98b, 5726320, a39be56, 6a3022d.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum, auto


class HomingTarget(Enum):
    """Where a move goes."""

    CONTACT = auto()
    """The last position read while searching."""
    GRASP = auto()
    """The closed end of the window."""
    EXTEND = auto()
    """The open end of the window."""
    BACK_OFF = auto()
    """Half a turn away from the contact, toward open."""
    SHORT_OF_EXTEND = auto()
    """The open end less 625 counts, toward closed."""


@dataclass(frozen=True)
class Move:
    """One goal write."""

    speed: int
    """Goal speed, register units."""
    acceleration: int
    """Acceleration, register units."""
    torque: int
    """Goal torque, register units."""


@dataclass(frozen=True)
class Go:
    """Write a goal and wait, whether or not it is reached."""

    to: HomingTarget
    """Where to."""
    move: Move
    """How."""
    wait_ms: int
    """Pause afterwards, ms."""


@dataclass(frozen=True)
class Calibrate:
    """Make the present position 2048 and wait."""

    wait_ms: int
    """Pause afterwards, ms."""


@dataclass(frozen=True)
class ReadPosition:
    """Read where the channel is, for `HomingTarget.BACK_OFF`."""


@dataclass(frozen=True)
class ShiftWindow:
    """Move both ends of the window away from the contact."""

    counts: int
    """By how much."""


Step = Go | Calibrate | ReadPosition | ShiftWindow


class Limits(Enum):
    """What homing does to the servos' angle limits."""

    UNTOUCHED = auto()
    """Nothing."""
    WINDOW = auto()
    """Open before the search, the window with a margin after it."""
    OPEN = auto()
    """Open before the search, left so."""


@dataclass(frozen=True)
class HomingPlan:
    """One version's homing."""

    search: Move
    """How contact is sought; its torque is replaced by the channel's threshold."""
    thresholds: tuple[int, ...]
    """Current at which contact is assumed, which is the torque of the search too, register units, by channel."""
    timeout_ms: int
    """Longest search, ms."""
    steps: tuple[tuple[Step, ...], ...]
    """What follows the contact, by channel."""
    groups: tuple[tuple[int, ...], ...]
    """Channels that search at the same time, in order."""
    release: Move | None
    """How a channel of a group waits at its contact for the others; None for groups of one."""
    final: tuple[int, ...] = tuple(range(7))
    """Channels moved to the open end at last."""
    final_move: Move = Move(2400, 0, 1023)
    """How."""
    limits: Limits = Limits.UNTOUCHED
    """What is done to the angle limits."""
    repairs_current_limit: bool = False
    """Whether protection currents other than 1023 are set to that afterwards."""


_CRAWL = Move(10, 10, 0)
_HOLD = Move(60, 50, 1000)
_WALK = Move(60, 50, 500)
_RUN = Move(2400, 0, 1000)


_SLOW_CONTACT: tuple[Step, ...] = (Go(HomingTarget.CONTACT, _HOLD, 30), Calibrate(50), ReadPosition())
_SLOW_BACK_OFF: tuple[Step, ...] = (Go(HomingTarget.BACK_OFF, _WALK, 1500), Calibrate(500))
_SLOW_ABDUCTION = (*_SLOW_CONTACT, Go(HomingTarget.GRASP, _WALK, 2000))
_SLOW_CMC = (*_SLOW_CONTACT, Go(HomingTarget.EXTEND, _WALK, 1000))
_SLOW_FLEXOR = (*_SLOW_CONTACT, *_SLOW_BACK_OFF, Go(HomingTarget.SHORT_OF_EXTEND, _WALK, 1000))
_SLOW_FINGER = (*_SLOW_CONTACT, *_SLOW_BACK_OFF, Go(HomingTarget.EXTEND, _WALK, 1000))

_FAST_CONTACT: tuple[Step, ...] = (Go(HomingTarget.CONTACT, _RUN, 30), Calibrate(30), ReadPosition())
_FAST_ABDUCTION = (*_FAST_CONTACT, Go(HomingTarget.GRASP, _RUN, 250))
_FAST_CMC = (*_FAST_CONTACT, Go(HomingTarget.EXTEND, _RUN, 250))
_FAST_FLEXOR = (
    *_FAST_CONTACT,
    Go(HomingTarget.BACK_OFF, _RUN, 250),
    Calibrate(30),
    Go(HomingTarget.SHORT_OF_EXTEND, _RUN, 30),
)
_FAST_FINGER = (*_FAST_CONTACT, Go(HomingTarget.BACK_OFF, _RUN, 300), Calibrate(30), Go(HomingTarget.EXTEND, _RUN, 0))
_SHIFT: tuple[Step, ...] = (ShiftWindow(113),)
"""Ten degrees of 4095 counts a turn, truncated."""

HOMING_0_1_0 = HomingPlan(
    search=_CRAWL,
    thresholds=(750, *[950] * 6),
    timeout_ms=25_000,
    steps=(_SLOW_ABDUCTION, _SLOW_CMC, *[_SLOW_FINGER] * 5),
    groups=tuple((channel,) for channel in range(7)),
    release=None,
)
HOMING_PRE = replace(HOMING_0_1_0, thresholds=(650, *[950] * 6), final=(0, 2), final_move=_WALK)
HOMING_0_1_1 = replace(
    HOMING_0_1_0,
    steps=(_SLOW_ABDUCTION, _SLOW_CMC, _SLOW_FLEXOR, *[_SLOW_FINGER] * 4),
    limits=Limits.WINDOW,
)
HOMING_0_1_3 = HomingPlan(
    search=_RUN,
    thresholds=(950,) * 7,
    timeout_ms=10_000,
    steps=(_FAST_ABDUCTION, _FAST_CMC, _FAST_FLEXOR, *[_FAST_FINGER] * 4),
    groups=((0,), (1,), (2,), (3, 4, 5, 6)),
    release=_HOLD,
    limits=Limits.OPEN,
)
HOMING_0_1_5 = replace(HOMING_0_1_3, repairs_current_limit=True)
HOMING_0_2_0 = replace(
    HOMING_0_1_5,
    steps=(
        (*_FAST_CONTACT, *_SHIFT, *_FAST_ABDUCTION[3:]),
        (*_FAST_CONTACT, *_SHIFT, *_FAST_CMC[3:]),
        *HOMING_0_1_5.steps[2:],
    ),
)
