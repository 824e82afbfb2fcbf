"""Why a guard stops a hand, and the exceptions that say so."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aero.channels import Channel
from aero.exit_code import Exit

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Health:
    """What a hand says about itself while nothing moves, arrays (7,) in command order."""

    codes: NDArray[np.uint16]
    currents_a: Floats
    temperatures_c: Floats


class Phase(Enum):
    """Where a guarded hand is."""

    RESTING = "nothing has moved yet"
    OPENING = "it opens and approaches its first goal slowly, with limited speed and torque"
    MOVING = "the program moves it"
    ENDING = "it opens slowly for the last time"
    STOPPED = "it was opened and takes no more commands"


class SafetyReason(Enum):
    """Why a hand was stopped, or not moved at all. Programs decide by this, never by a message's text."""

    CURRENT = "current"
    """A channel drew more than `Thresholds.current_a` for too long."""
    CURRENT_AT_REST = "current at rest"
    """A channel drew more than that before anything moved."""
    TEMPERATURE = "temperature"
    """A servo is too hot."""
    STALE = "stale telemetry"
    """Readings repeat to the last digit."""
    SILENT = "no answer"
    """The board has left readings unanswered for too long."""
    UNWATCHED = "unwatched"
    """Nobody polled a hand that is not open for too long."""
    JUMP = "jump"
    """An encoder moved faster than a servo can turn."""
    STRAY = "stray"
    """An encoder is not where its channel was commanded to be."""
    MOTION_AT_REST = "motion at rest"
    """An encoder moved without a command."""
    STILL_CLOSED = "still closed"
    """An encoder did not arrive at the slow opening before the first motion."""
    NOT_OPENED = "not opened"
    """The program ended, and the hand may not be open; nothing else was wrong."""
    LINK_LOST = "link lost"
    """The link was lost while a hand may have been closed; nothing else was wrong."""
    ENDED = "ended"
    """The program has ended this hand, and asks for more."""
    FORKED = "forked"
    """A forked process used the hand of its parent."""
    NO_STANDBY = "no standby process"
    """The second process did not start."""
    NOT_PERMITTED = "not permitted"
    """What was asked for would stop the hand."""


class Violation(NamedTuple):
    """What is wrong with a hand."""

    reason: SafetyReason
    text: str
    """The same for people, with what to do."""
    channel: Channel | None = None
    """The channel that it is about; None for all of them."""


class SafetyStopError(Exception):
    """A hand was stopped, or not moved at all, because going on was not safe.

    Not an `AeroError`: a program that puts up with a lost reading must not put up with this.
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
        """The channel that the reason is about; None for all of them."""


class LinkLostError(SafetyStopError, ConnectionError):
    """The link was lost while a hand may have been closed, so that it could not be opened; nothing else was wrong."""

    exit_code = Exit.NO_HAND
