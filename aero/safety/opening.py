"""Slow motion of a hand: ramps, and the final opening with low torque."""

from collections.abc import Callable
from contextlib import suppress
from math import ceil

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aero.channels import Channel
from aero.clock import Clock, Deadline
from aero.driver import AeroHand
from aero.errors import AeroError
from aero.protocol import MAX_CODE
from aero.safety.regions import Gate
from aero.safety.thresholds import Thresholds

STEP_S = 0.02
"""Command period of a ramp, s."""
LOOK_S = 0.05
"""Period of arrival readings, s; above the telemetry period of the slowest firmware."""
AT_REST = 0.005
"""Threshold of motion between two readings, fraction of the window; below it a channel is at rest."""
HELD = 10
"""Number of open commands under the final limits; a link that drops 30 % of them drops all in 1 of 10^5 openings."""
LIVE_LOOKS = 3
"""Least number of arrival readings; they must differ, so that a frozen telemetry cache is not accepted."""
OPEN = (0,) * len(Channel)
RESTARTS = 2
"""Number of board restarts that restart the time-out, because the board homes first. A weak supply may cause more."""
SWITCH_OFF = "SWITCH THE HAND'S SUPPLY OFF: it may still be closed"
"""Remedy for a hand that cannot be opened by software."""


def move_slowly(
    command: Callable[[NDArray[np.int64]], None],
    clock: Clock,
    start_codes: ArrayLike,
    goal_codes: ArrayLike,
    seconds: float,
) -> None:
    """Ramp all channels from a start to a goal.

    Args:
        command: sends every channel to a position: `AeroHand.command_codes` or `command_codes_blindly`.
        clock: clock of the hand.
        start_codes: (7,) in 0..65535, current position.
        goal_codes: (7,) in 0..65535.
        seconds: duration for a whole window; proportionally less for a shorter way, in whole periods.

    Raises:
        ConnectionError: the link is lost.
    """
    start, goal = np.asarray(start_codes, np.float64), np.asarray(goal_codes, np.float64)
    steps = max(1, ceil(seconds / STEP_S * float(np.abs(goal - start).max()) / MAX_CODE))
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
    homes_s: float = 0.0,
) -> str | None:
    """Open a hand slowly, lower its torque limit, and verify both, in any state of hand and link.

    A hand counts as open if live encoders show it, under a torque limit that the board has acknowledged and not lost by
    a restart. Until then the function retries: it resynchronises the board, restores position mode, and waits for a
    starting board. For a silent board a ramp is sent without waiting for replies, so a board that receives but cannot
    send opens too.

    Args:
        hand: hand to open.
        clock: clock of the hand.
        thresholds: speed, torque and time-outs of the opening.
        settable: whether the firmware has speed and torque limits; `pre` has none.
        silent: whether the board has just not answered; the ramp without replies is then sent first.
        last_codes: (7,), start of the ramp if the encoders cannot be read: the last command, or open if unknown.
        homes_s: longest remaining time of a homing in progress, during which the board is silent.

    Returns:
        Reason why the hand may not be open; None for an open hand.

    Raises:
        ConnectionError: the link is lost.
    """
    deadline, restarts = Deadline.after(clock, thresholds.opening_patience_s + homes_s), hand.restarts
    last = restarts
    attempt = _Attempt(hand, clock, thresholds, settable, silent=silent)
    doubt = "the board does not answer" if silent else attempt.run()
    if attempt.silent:
        with suppress(AeroError):  # refused after an incomplete frame, until the board is back in step
            attempt.gate.seen(last_codes)
            move_slowly(attempt.command_blindly, clock, last_codes, OPEN, thresholds.opening_s)
    while doubt is not None and not deadline.expired:
        with suppress(AeroError):  # the next attempt reports the remaining error
            if attempt.silent:
                hand.resynchronise()
            elif settable:
                # A restarted board assumes position mode and writes only mode changes; force one.
                hand.command_torques([0] * len(Channel))
        with suppress(AeroError):
            attempt.command_blindly(OPEN)
        doubt = attempt.run()
        if last < hand.restarts <= restarts + RESTARTS:
            deadline, last = Deadline.after(clock, thresholds.opening_patience_s), hand.restarts
    return doubt


class _Attempt:
    """Repeatable attempt at opening a hand."""

    def __init__(self, hand: AeroHand, clock: Clock, thresholds: Thresholds, settable: bool, *, silent: bool) -> None:
        self._hand, self._clock, self._thresholds, self._settable = hand, clock, thresholds, settable
        self.silent = silent
        """True if the board did not answer the first reading of the last attempt."""
        self.gate = Gate(thresholds.forbidden)

    def command_blindly(self, codes: ArrayLike) -> None:
        """Send every channel near a position, without an opcode after the first byte, around forbidden regions."""
        self._hand.command_codes_blindly(self.gate.passed(codes))

    def _command(self, codes: ArrayLike) -> None:
        self._hand.command_codes(self.gate.passed(codes))

    def _read(self) -> NDArray[np.uint16]:
        codes = self._hand.read_codes()
        self.gate.seen(codes)
        return codes

    def run(self) -> str | None:
        """Ramp open under gentle limits, lower the torque, and return the reason for doubt that it is open, or None."""
        limits, self.silent = self._thresholds, True
        try:
            where, restarts = self._read(), self._hand.restarts
            self.silent = False
            self._limit(limits.gentle_torque)
            move_slowly(self._command, self._clock, where, OPEN, limits.opening_s)
            self._come_to_rest()
            self._limit(limits.limp_torque)
            self._hold_open()
            doubt = self._arrival()
        except AeroError as error:
            return f"the board does not answer as it should ({error})"
        return "the board has restarted meanwhile" if self._hand.restarts != restarts else doubt

    def _limit(self, torque: int) -> None:
        """Set the limits of all channels; the board applies them with the next position command."""
        for channel in Channel if self._settable else ():
            self._hand.set_speed(channel, self._thresholds.gentle_speed)
            self._hand.set_torque(channel, torque)

    def _come_to_rest(self) -> None:
        """Wait until the hand is at rest, so that the torque is lowered only at the end of the motion."""
        deadline = Deadline.after(self._clock, self._thresholds.opening_s / 2)
        before = np.full(len(Channel), np.inf)
        while not deadline.expired:
            self._clock.sleep_until(self._clock.now() + LOOK_S)
            codes = self._read().astype(np.float64)
            if np.abs(codes - before).max() < AT_REST * MAX_CODE:
                return
            before = codes

    def _hold_open(self) -> None:
        """Repeat the open command, because commands are not acknowledged and limits need one to take effect."""
        for _ in range(HELD):
            self._command(OPEN)
            self._clock.sleep_until(self._clock.now() + STEP_S)

    def _arrival(self) -> str | None:
        """Wait until live readings show an open hand; return the deviation at the time-out, or None."""
        deadline = Deadline.after(self._clock, self._thresholds.opening_s / 2)
        seen: set[bytes] = set()
        looks = 0
        while True:
            self._clock.sleep_until(self._clock.now() + LOOK_S)
            codes = self._read()
            seen.add(codes.tobytes() + self._hand.read_currents().tobytes())
            looks += 1
            live, doubt = len(seen) > 1, self._closed(codes)
            if live and looks >= LIVE_LOOKS and doubt is None:
                return None
            if deadline.expired:
                break
        if not live:
            return (
                "its readings do not change, so the board does not reach all its servos; those that it reaches "
                "were told to open"
            )
        return doubt

    def _closed(self, codes: NDArray[np.uint16]) -> str | None:
        """Return a message naming the channels that are more closed than a region requires, or None."""
        shares, allowed = codes / MAX_CODE, self._thresholds.arrival + self.gate.outcome(OPEN) / MAX_CODE
        named = [f"{one.label} is {shares[one]:.0%} closed" for one in Channel if shares[one] > allowed[one]]
        return ", ".join(named) if named else None
