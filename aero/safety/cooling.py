"""Wait for servos that a homing has heated.

A homing ends with its last channel. One that is dead or blocked makes it last until its timeout, and the others press
against their stops meanwhile: their motors reach 70 °C, and pass most of that heat on within half a minute.
"""

from collections.abc import Callable
from contextlib import suppress

from aero.clock import Clock
from aero.errors import AeroError
from aero.floats import Floats

HOT_C = 60.0
"""Least temperature that is waited for, °C. Recordings of healthy hands in use reach 58."""
COOLED_C = 52.0
"""Temperature that ends the wait, °C (assumption): 13 K, a few minutes of motion, below the guard's limit."""
LONGEST_S = 60.0
"""Longest wait, s, four time constants of a motor; a servo that stays hot is a finding."""
POLL_S = 1.0
"""Period of the readings, s."""


def let_cool(
    temperatures: Callable[[], Floats],
    clock: Clock,
    progress: Callable[[float, str], None] = lambda _share, _text: None,
) -> None:
    """Wait without motion until a hot hand has cooled to `COOLED_C`, or `LONGEST_S`; return at once if none is hot.

    Temperatures that do not arrive end the wait.

    Args:
        temperatures: reading of a hand at rest, (7,) °C.
        clock: clock of the hand.
        progress: called with the elapsed fraction of the longest wait and a description.
    """
    start, limit_c = clock.now(), HOT_C
    with suppress(AeroError):
        while (hottest := float(max(temperatures()))) > limit_c and clock.now() - start < LONGEST_S:
            progress((clock.now() - start) / LONGEST_S, f"hottest servo {hottest:.0f} °C, cooling down")
            clock.sleep_until(clock.now() + POLL_S)
            limit_c = COOLED_C
