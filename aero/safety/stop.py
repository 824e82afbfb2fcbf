"""Reasons for which a guard stops a hand, and the exceptions with them."""

from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aero.channels import Channel
from aero.exit_code import Exit
from aero.floats import Floats


@dataclass(frozen=True)
class Health:
    """Readings at rest, arrays (7,) in command order."""

    codes: NDArray[np.uint16]
    currents_a: Floats
    temperatures_c: Floats


class Phase(Enum):
    """Phase of a guarded hand."""

    RESTING = "nothing has moved yet"
    OPENING = "it opens and approaches its first goal slowly, with limited speed and torque"
    MOVING = "the program moves it"
    ENDING = "it opens slowly for the last time"
    STOPPED = "it was opened and takes no more commands"


class SafetyReason(Enum):
    """Reason why a hand was stopped or not moved; programs compare this, never message texts."""

    CURRENT = "current"
    """Current above `Thresholds.current_a` for longer than `current_s`."""
    CURRENT_AT_REST = "current at rest"
    """Current above `Thresholds.current_a` before the first motion."""
    TEMPERATURE = "temperature"
    """Servo temperature at or above `Thresholds.temperature_c`."""
    STALE = "stale telemetry"
    """Identical readings for longer than `Thresholds.stale_s`."""
    SILENT = "no answer"
    """No reply for `Thresholds.silent_s`."""
    UNWATCHED = "unwatched"
    """No poll of a closed hand for `Thresholds.unwatched_s`."""
    JUMP = "jump"
    """An encoder moved faster than a servo can turn."""
    STRAY = "stray"
    """An encoder deviates from the commands of its channel."""
    MOTION_AT_REST = "motion at rest"
    """An encoder moved without a command."""
    RESTARTED = "restarted"
    """The board of a guarded port restarted while the hand was closed."""
    CLIENT_ENDED = "client ended"
    """The client of a guarded port ended while the hand was closed."""
    STILL_CLOSED = "still closed"
    """An encoder did not arrive in the slow opening before the first motion."""
    NOT_OPENED = "not opened"
    """The program ended without another violation, but the hand may not be open."""
    LINK_LOST = "link lost"
    """The link was lost at the end of the program, without another violation."""
    ENDED = "ended"
    """Call after the end of the guarded hand."""
    FORKED = "forked"
    """Call in a forked process on the hand of its parent."""
    NO_STANDBY = "no standby process"
    NOT_PERMITTED = "not permitted"
    """Refused request that would have stopped the hand."""


class Violation(NamedTuple):
    """Violation of a threshold or a safety rule."""

    reason: SafetyReason
    text: str
    """Message for the user, with a remedy."""
    channel: Channel | None = None
    """Affected channel; None for the whole hand."""


class SafetyStopError(Exception):
    """A hand was stopped, or not moved, for safety.

    Deliberately not an `AeroError`: a program that tolerates a lost reading must not tolerate a stop.
    """

    exit_code = Exit.STOPPED

    def __init__(
        self,
        message: str,
        reason: SafetyReason = SafetyReason.NOT_PERMITTED,
        channel: Channel | None = None,
    ) -> None:
        super().__init__(message)
        self.reason = reason
        self.channel = channel
        """Affected channel; None for the whole hand."""


class LinkLostError(SafetyStopError, ConnectionError):
    """The link was lost at the end of the program, so that the hand could not be opened."""

    exit_code = Exit.NO_HAND
