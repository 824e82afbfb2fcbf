"""Moving a hand slowly: at the start of a guarded program, and open and weak at its end."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aero.channels import Channel
from aero.clock import Clock, Deadline
from aero.driver import AeroHand
from aero.errors import AeroError
from aero.protocol import MAX_CODE
from aero.safety.thresholds import Thresholds

STEP_S = 0.02
"""Time from one command of the ramp to the next, s."""
LOOK_S = 0.05
"""Time from one reading of whether it has arrived to the next, s: more than the slowest firmware's telemetry period."""
AT_REST = 0.005
"""Fraction of the window that a channel at rest may move between two readings."""
HELD = 10
"""Commands of the open hand under its last limits: of a link that loses three of ten, one opening in 10^5 loses all."""
LIVE_LOOKS = 3
"""Readings of which the last must differ from an earlier one, so that a board's frozen cache is not believed."""
OPEN = (0,) * len(Channel)
"""Codes of the open hand."""
RESTARTS = 2
"""Restarts of the board after each of which the patience begins again: it homes first. A weak supply may cause more."""
SWITCH_OFF = "SWITCH THE HAND'S SUPPLY OFF: it may still be closed"
"""What to do about a hand that cannot be opened from here."""


def move_slowly(
    command: Callable[[NDArray[np.int64]], None],
    clock: Clock,
    start_codes: ArrayLike,
    goal_codes: ArrayLike,
    seconds: float,
) -> None:
    """Ramp all channels from where they stand to a goal.

    Args:
        command: sends every channel to a position, as `AeroHand.command_codes` and `command_codes_blindly` do.
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
        command(np.rint(start + (goal - start) * step / steps).astype(np.int64))
        clock.sleep_until(begin + step * STEP_S)


def open_and_relax(
    hand: AeroHand,
    clock: Clock,
    thresholds: Thresholds,
    *,
    settable: bool,
    last_codes: ArrayLike = OPEN,
    silent: bool = False,
) -> str | None:
    """Open a hand slowly and weakly, leave it weak, and see that it is so, whatever state it and the link are in.

    It counts as open when encoders that are live say so, under a torque limit that the board has acknowledged and has
    not lost by a restart since. Until then everything is tried that is left: bringing the board back into step,
    putting its servos back into position mode, and waiting for a board that is just starting. The first ramp needs no
    answer, so a board that receives but does not send is opened too.

    Args:
        hand: what opens.
        clock: of the hand.
        thresholds: how slowly, how weakly and how patiently.
        settable: whether the firmware takes speed and torque limits; `pre` does not.
        silent: whether the board has just left questions unanswered: the ramp that needs no answer comes first then.
        last_codes: (7,), where the ramp starts when the encoders cannot be read: the last command; open when unknown.

    Returns:
        Why it may not be open, None when it is.

    Raises:
        ConnectionError: the link is gone.
    """
    deadline, restarts, last = Deadline.after(clock, thresholds.opening_patience_s), hand.restarts, hand.restarts
    attempt = _Attempt(hand, clock, thresholds, settable, silent=silent)
    doubt = "the board does not answer" if silent else attempt.run()
    if attempt.silent:
        with suppress(AeroError):  # a frame that went out incomplete forbids it until the board is back in step
            move_slowly(hand.command_codes_blindly, clock, last_codes, OPEN, thresholds.opening_s)
    while doubt is not None and not deadline.expired:
        with suppress(AeroError):  # the next attempt says what is still wrong
            if attempt.silent:
                hand.resynchronise()
            elif settable:
                # A board that has restarted believes its servos in position mode, and writes only a change of mode.
                hand.command_torques([0] * len(Channel))
        with suppress(AeroError):
            hand.command_codes_blindly(OPEN)
        doubt = attempt.run()
        if last < hand.restarts <= restarts + RESTARTS:
            deadline, last = Deadline.after(clock, thresholds.opening_patience_s), hand.restarts
    return doubt


class _Attempt:
    """One try after another at opening a hand."""

    def __init__(self, hand: AeroHand, clock: Clock, thresholds: Thresholds, settable: bool, *, silent: bool) -> None:
        self._hand, self._clock, self._thresholds, self._settable = hand, clock, thresholds, settable
        self.silent = silent
        """Whether the last try got no answer at its beginning."""

    def run(self) -> str | None:
        """Ramp open under gentle limits, weaken, and return why the hand may not be open, or None."""
        limits, self.silent = self._thresholds, True
        try:
            where, restarts = self._hand.read_codes(), self._hand.restarts
            self.silent = False
            self._limit(limits.gentle_torque)
            move_slowly(self._hand.command_codes, self._clock, where, OPEN, limits.opening_s)
            self._come_to_rest()
            self._limit(limits.limp_torque)
            self._hold_open()
            doubt = self._arrival()
        except AeroError as error:
            return f"the board does not answer as it should ({error})"
        return "the board has restarted meanwhile" if self._hand.restarts != restarts else doubt

    def _limit(self, torque: int) -> None:
        """Limit all channels; the board applies it with the next position command."""
        for channel in Channel if self._settable else ():
            self._hand.set_speed(channel, self._thresholds.gentle_speed)
            self._hand.set_torque(channel, torque)

    def _come_to_rest(self) -> None:
        """Wait until the hand no longer moves, so that what is weakened next is at its end."""
        deadline = Deadline.after(self._clock, self._thresholds.opening_s / 2)
        before = np.full(len(Channel), np.inf)
        while not deadline.expired:
            self._clock.sleep_until(self._clock.now() + LOOK_S)
            codes = self._hand.read_codes().astype(np.float64)
            if np.abs(codes - before).max() < AT_REST * MAX_CODE:
                return
            before = codes

    def _hold_open(self) -> None:
        """Command the open hand often: nothing says that a command has come, and limits count from the next one on."""
        for _ in range(HELD):
            self._hand.command_codes(OPEN)
            self._clock.sleep_until(self._clock.now() + STEP_S)

    def _arrival(self) -> str | None:
        """Wait until live readings show an open hand; return what they show instead, or None."""
        deadline = Deadline.after(self._clock, self._thresholds.opening_s / 2)
        seen: set[bytes] = set()
        looks = 0
        while True:
            self._clock.sleep_until(self._clock.now() + LOOK_S)
            codes = self._hand.read_codes()
            seen.add(codes.tobytes() + self._hand.read_currents().tobytes())
            looks += 1
            live, doubt = len(seen) > 1, _closed(codes, self._thresholds.arrival)
            if live and looks >= LIVE_LOOKS and doubt is None:
                return None
            if deadline.expired:
                break
        if not live:
            return (
                "its readings stand still, so that the board does not reach all its servos; those that it reaches "
                "were told to open"
            )
        return doubt


def _closed(codes: NDArray[np.uint16], arrival: float) -> str | None:
    """Return which channels are closed, or None."""
    shares = codes / MAX_CODE
    named = [f"{channel.label} is {shares[channel]:.0%} closed" for channel in Channel if shares[channel] > arrival]
    return ", ".join(named) if named else None
