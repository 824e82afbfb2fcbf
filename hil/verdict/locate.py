"""Which channels are off, and what a single finding decides about the place."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Mapping

from aero.actuation.window import SHIFT_CLOSING
from aero.channels import Channel
from aero.safety import SafetyStopError
from hil.checks import DRIVER, Measured
from hil.verdict.ending import EndSignature
from hil.verdict.explanation import Diagnosis, Effect, Explanation, LikelyEffect, Place, Whereabouts
from hil.verdict.signature import Key, out_of_limits

DRIVER_OR_MAP = "driver_or_map"
MISTAKEN = Diagnosis(
    (Whereabouts(Place.HOST_AND_DRIVER, None, 1.0),),
    (LikelyEffect(Effect.COMMANDS, 1.0),),
    (
        Explanation(
            DRIVER_OR_MAP, None, 1.0, None, "The driver or the map sends or reads something else than was meant"
        ),
    ),
    (DRIVER_OR_MAP,),
)
"""What a failed check of the driver says; what the hand reads says nothing then."""

OLDER = 0.95
"""How likely a limit that stays unanswered, on a link that loses nothing else, tells older firmware (assumption): a
link that lost this one reply would look the same."""
OLDER_FIRMWARE = Diagnosis(
    (Whereabouts(Place.BOARD, None, OLDER),),
    (LikelyEffect(Effect.VERSION, OLDER),),
    (Explanation("version", None, OLDER, None, "The board runs an older firmware than was said."),),
    ("version",),
)
"""What a board says that leaves a limit unanswered."""

ROUNDED_COUNTS = 2.0
"""Room for the rounding of whole degrees, counts."""
EITHER = 0.5
"""Share of each of two causes that leave the same windows: nothing on this wire tells them apart (assumption)."""
OTHER_WINDOWS = Diagnosis(
    (Whereabouts(Place.BOARD, None, 1.0),),
    (LikelyEffect(Effect.VERSION, EITHER), LikelyEffect(Effect.RESTART, EITHER)),
    (
        Explanation("version", None, EITHER, None, "The board has the thumb's windows of another firmware."),
        Explanation("nvs_lost", None, EITHER, None, "The board was not homed since it was flashed or lost its zeros."),
    ),
    ("version", "nvs_lost"),
)
"""What a board says whose thumb windows are those of firmware 0.2.0 where others were meant, or the other way round."""


LIMIT_UNANSWERED = re.compile(r"no reply to SET_(SPE|TOR)\b")
"""The driver's words for a limit that a board does not know; the guard sends one before the first motion."""


def older_firmware(excesses: Mapping[Key, float], ending: EndSignature) -> bool:
    """Return whether the board does not know limits, while no other reply was lost and it did not restart.

    Args:
        excesses: of a run's readings, see `Limit.excess`.
        ending: how the run ended; a guard stops a hand that leaves the first limit unanswered.
    """
    if not excesses and ending.error == SafetyStopError.__name__:
        return LIMIT_UNANSWERED.search(ending.reason) is not None
    beyond = {metric for (check, metric, _), excess in excesses.items() if check == "session" and out_of_limits(excess)}
    return beyond == {"unanswered_limits"}


def windows_moved(numbers: Mapping[str, Measured], excesses: Mapping[Key, float]) -> Diagnosis | None:
    """Return what moved windows say, which the board itself tells; None where none moved or no cause is that plain.

    Args:
        numbers: what was measured, by experiment.
        excesses: of a run's readings, see `Limit.excess`.
    """
    moved = {
        channel: numbers["window"][channel.label]["window_moved"]
        for channel in Channel
        if out_of_limits(excesses.get(("window", "window_moved", channel.label), 0.0))
    }
    if _as_other_firmware(moved):
        return OTHER_WINDOWS
    if len(moved) != 1:
        return None
    (channel,) = moved
    return Diagnosis(
        (Whereabouts(Place.ONE_CHANNEL, channel, 1.0),),
        (LikelyEffect(Effect.SETTINGS, 1.0),),
        (Explanation("trim_left_in", channel, 1.0, None, "The board holds a trim of this channel."),),
        ("trim_left_in",),
    )


def _as_other_firmware(moved: Mapping[Channel, float]) -> bool:
    """Return whether just the windows moved that 0.2.0 moves, by as much and both to the same version's side."""
    return moved.keys() == SHIFT_CLOSING.keys() and any(
        all(abs(counts - sign * SHIFT_CLOSING[channel]) <= ROUNDED_COUNTS for channel, counts in moved.items())
        for sign in (-1, 1)
    )


def driver_mistaken(excesses: Mapping[Key, float]) -> bool:
    """Return whether a check of the driver failed, by the excesses of a run's readings (`Limit.excess`)."""
    return any(out_of_limits(excess) for (check, _, _), excess in excesses.items() if check == DRIVER.name)


def channels_off(excesses: Mapping[Key, float]) -> tuple[tuple[str, float], ...]:
    """Return the channels, by label, and `hand` with readings beyond a limit, and the largest excess of each.

    Args:
        excesses: of a run's readings, see `Limit.excess`.
    """
    furthest: dict[str, float] = defaultdict(float)
    for (_, _, subject), excess in excesses.items():
        furthest[subject] = max(furthest[subject], abs(excess))
    return tuple(sorted(((on, far) for on, far in furthest.items() if far > 1.0), key=lambda pair: (-pair[1], pair[0])))
