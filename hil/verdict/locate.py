"""Which channels are off, and what a single finding decides about the place."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping

from hil.checks import DRIVER
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


def older_firmware(excesses: Mapping[Key, float]) -> bool:
    """Return whether the board does not know limits, while no other reply was lost and it did not restart."""
    beyond = {metric for (check, metric, _), excess in excesses.items() if check == "session" and out_of_limits(excess)}
    return beyond == {"unanswered_limits"}


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
