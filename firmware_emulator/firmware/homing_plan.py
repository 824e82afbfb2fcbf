"""Homing plans as data: the steps of each channel in each firmware version.

Sources: aero-open-firmware 46bc858 and d7bd82e, `Homing.cpp`; aero-hand-open 890c98b, 5726320, a39be56, 6a3022d.
"""

from dataclasses import dataclass, replace
from enum import Enum, auto


class HomingTarget(Enum):
    """Target of a homing move."""

    CONTACT = auto()
    """Last position read during the search."""
    GRASP = auto()
    """Closed end of the window."""
    EXTEND = auto()
    """Open end of the window."""
    BACK_OFF = auto()
    """Half a turn from the contact toward open."""
    SHORT_OF_EXTEND = auto()
    """625 counts from the open end toward closed."""


@dataclass(frozen=True)
class Move:
    """Motion parameters of a goal write."""

    speed: int
    """Goal speed, register units."""
    acceleration: int
    """Acceleration, register units."""
    torque: int
    """Goal torque, register units."""


@dataclass(frozen=True)
class Go:
    """Write a goal and wait a fixed time, without checking the position."""

    to: HomingTarget
    move: Move
    """Speed, acceleration and torque of the move."""
    wait_ms: int


@dataclass(frozen=True)
class Calibrate:
    """Make the present position 2048 and wait."""

    wait_ms: int


@dataclass(frozen=True)
class ReadPosition:
    """Read the channel's position, for `HomingTarget.BACK_OFF`."""


@dataclass(frozen=True)
class ShiftWindow:
    """Shift both ends of the window away from the contact."""

    counts: int
    """Size of the shift, counts."""


Step = Go | Calibrate | ReadPosition | ShiftWindow


class Limits(Enum):
    """Handling of the servos' angle limits during homing."""

    UNTOUCHED = auto()
    """Never written."""
    WINDOW = auto()
    """Removed before the search, set to the window plus a margin afterwards."""
    OPEN = auto()
    """Removed before the search; stays removed."""


@dataclass(frozen=True)
class HomingPlan:
    """Homing procedure of one firmware version."""

    search: Move
    """Motion of the search; its torque is replaced by the channel's threshold."""
    thresholds: tuple[int, ...]
    """Threshold of the current, register units, by channel; at it contact is assumed. Also the search torque."""
    timeout_ms: int
    """Longest search, ms."""
    steps: tuple[tuple[Step, ...], ...]
    """Steps after the contact, by channel."""
    groups: tuple[tuple[int, ...], ...]
    """Groups of channels that search simultaneously, in order."""
    release: Move | None
    """Motion that holds a channel at its contact until its group has finished; None for groups of one."""
    final: tuple[int, ...] = tuple(range(7))
    """Channels moved to the open end in the last step."""
    final_move: Move = Move(2400, 0, 1023)
    """Motion of the last step."""
    limits: Limits = Limits.UNTOUCHED
    repairs_current_limit: bool = False
    """Whether every protection current is set to 1023 afterwards."""


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
"""Shift by ten degrees at 4095 counts a turn, truncated."""

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
