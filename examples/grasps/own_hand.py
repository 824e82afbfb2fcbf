"""Make a grasp with a hand of one's own, guarded: it takes the shape, waits for the object, closes, and opens again."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from aero.channels import Channel
from hil.targets.target import Target

from .grasp import Grasp
from .trial import codes_of

PERIOD_S = 0.02
"""Between commands, s."""
MOVING_S = 1.5
"""Time for a motion from one closure to the next, s: about half as fast as in the trials."""
OPEN = (0.0,) * len(Channel)


def make_grasp(target: Target, grasp: Grasp, placing_s: float, holding_s: float) -> NDArray[np.uint16]:
    """Make `grasp` with an opened hand, hold it, and open the hand again.

    However it ends, a guarded hand is opened by its guard when the target is closed.

    The channels that close on the object push against it for long. A guarded hand is therefore weakened to the torque
    that the guard allows at a stop, 500 of 700, and the guard stops it as ever: at a current, a temperature, or
    readings that do not arrive.

    Args:
        target: the hand.
        grasp: what to make.
        placing_s: time for a person to hold the object out to the shaped hand, s.
        holding_s: time from the closed hand to its opening, s.

    Returns:
        What the encoders read at the end of the hold, codes, (7,).

    Raises:
        SafetyStopError: the guard stopped the hand.
    """
    target.begin(stops=Channel)
    now = _move(target, OPEN, grasp.before(), MOVING_S)
    _move(target, now, now, placing_s)
    for _, closure in grasp.closing_up():
        now = _move(target, now, closure, MOVING_S)
    _move(target, now, now, holding_s)
    held = target.hand.read_codes()
    _move(target, now, OPEN, MOVING_S)
    return held


def _move(target: Target, start: Sequence[float], end: Sequence[float], lasts_s: float) -> Sequence[float]:
    """Move from one closure, (7,), to another, which is returned."""
    first, last = np.array(start), np.array(end)
    begun = target.clock.now()
    steps = max(1, round(lasts_s / PERIOD_S))
    for step in range(1, steps + 1):
        target.hand.command_codes(codes_of(first + (last - first) * step / steps, target.map))
        target.clock.sleep_until(begun + step * PERIOD_S)
    return end
