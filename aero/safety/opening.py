"""Moving a hand slowly: at the start of a guarded program, and open and weak at its end."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aero.channels import Channel
from aero.clock import Clock
from aero.driver import AeroHand
from aero.errors import AeroError
from aero.protocol import MAX_CODE
from aero.safety.thresholds import Settings, Thresholds

STEP_S = 0.02
"""Time from one command of the ramp to the next, s."""
OPEN = (0,) * len(Channel)
"""Codes of the open hand."""


def move_slowly(hand: AeroHand, clock: Clock, start_codes: ArrayLike, goal_codes: ArrayLike, seconds: float) -> None:
    """Ramp all channels from where they stand to a goal.

    Args:
        hand: what moves.
        clock: of the hand.
        start_codes: (7,) in 0..65535, where it stands.
        goal_codes: (7,) in 0..65535.
        seconds: time for the whole window; half the window takes half of it.

    Raises:
        ConnectionError: the link is gone.
    """
    start, goal = np.asarray(start_codes, np.float64), np.asarray(goal_codes, np.float64)
    steps = max(1, round(seconds / STEP_S * float(np.abs(goal - start).max()) / MAX_CODE))
    begin = clock.now()
    for step in range(1, steps + 1):
        hand.command_codes(np.rint(start + (goal - start) * step / steps).astype(np.int64))
        clock.sleep_until(begin + step * STEP_S)


def open_and_relax(
    hand: AeroHand, clock: Clock, thresholds: Thresholds, *, settable: bool, last_codes: ArrayLike = OPEN
) -> None:
    """Open a hand slowly and weakly, and leave it weak, whatever state it and the link are in.

    The ramp needs no answer, so a board that has gone silent is opened too.

    Args:
        hand: what opens.
        clock: of the hand.
        thresholds: how slowly and how weakly.
        settable: whether the firmware takes speed and torque limits; `pre` does not.
        last_codes: (7,), where the ramp starts when the encoders cannot be read: the last command; open when unknown.

    Raises:
        ConnectionError: the link is gone.
    """
    where = _where(hand)
    answers = where is not None
    if answers and settable:
        limit(hand, Settings(thresholds.gentle_speed, thresholds.gentle_torque))
    move_slowly(hand, clock, last_codes if where is None else where, OPEN, thresholds.opening_s)
    if answers and settable:
        limit(hand, Settings(thresholds.gentle_speed, thresholds.limp_torque))
        hand.command_codes(OPEN)


def limit(hand: AeroHand, settings: Settings) -> None:
    """Limit speed and torque of all channels; the board applies it with the next position command.

    Raises:
        AeroError, ConnectionError: as `AeroHand.set_speed`.
    """
    for channel in Channel:
        hand.set_speed(channel, settings.speed)
        hand.set_torque(channel, settings.torque)


def _where(hand: AeroHand) -> NDArray[np.uint16] | None:
    """Return the encoders' codes, None when the board does not answer, in step or not."""
    try:
        return hand.read_codes()
    except AeroError:
        pass  # it may wait for the rest of a frame
    try:
        hand.resynchronise()
        return hand.read_codes()
    except AeroError:
        return None
