"""How well a servo comes back: a small move there and back, a few times."""

from __future__ import annotations

from collections.abc import Callable

from hil.robots.feetech_bus import FeetechBus
from hil.robots.finding import Examined, Subject, Verdict
from hil.robots.survey import FEEDBACK, TORQUE, Surveyed

GOAL = 42
TIMES = 4
WAIT_S = 0.6
"""Time for a move of at most 200 counts, s."""
LARGEST_COUNTS = 200
SPREAD_COUNTS = 6
"""Places that it comes back to may differ by this, counts: the play of the gears is not measured by the encoder."""
STATIC_COUNTS = 40
"""How far from a goal it may stay under a load, counts (assumption)."""


def small_move(bus: FeetechBus, one: Surveyed, counts: int, wait: Callable[[float], None]) -> Examined:
    """Move a servo by `counts` and back, `TIMES` times, and leave its torque as it was.

    Args:
        bus: it is on.
        one: from `survey`.
        counts: how far, 1 to `LARGEST_COUNTS`.
        wait: lets a number of seconds pass.

    Raises:
        NoAnswerError, DamagedAnswerError: it stopped answering; its torque may be on.
    """
    name = f"servo {one.id} move"
    low, high = one.limits_counts if one.limits_counts != (0, 0) else (0, 4095)
    start = one.position_counts
    there = start + counts if start + counts <= high else start - counts
    if one.status or one.mode or not (low <= start <= high and low <= there):
        return Examined(
            name, Verdict.LOOK, "it was not moved: status, mode or angle limits speak against it",
            "put that right first", subject=Subject.HAND,
        )  # fmt: skip
    places: dict[int, list[int]] = {there: [], start: []}
    try:
        for _ in range(TIMES):
            for goal, reached in places.items():
                bus.write(one.id, GOAL, goal.to_bytes(2, one.byte_order))
                wait(WAIT_S)
                reached.append(_position(bus, one))
    finally:
        bus.write(one.id, TORQUE, bytes((one.torque,)))
    # The first time it may come from anywhere in its play.
    spread = max(max(reached[1:]) - min(reached[1:]) for reached in places.values())
    error = max(abs(place - goal) for goal, reached in places.items() for place in reached[1:])
    travel = abs(sum(places[there][1:]) - sum(places[start][1:])) / (TIMES - 1)
    said = f"comes back within {spread} counts, stays {error} from its goal at most"
    data = {"spread_counts": spread, "error_counts": error, "travel_counts": travel}
    if travel < 0.5 * counts:
        verdict, remedy = Verdict.WRONG, "look for a blocked joint; listen whether its motor turns"
        said = f"moved {travel:.0f} of {counts} counts"
    elif spread > SPREAD_COUNTS or error > STATIC_COUNTS:
        verdict, remedy = Verdict.LOOK, "look for a loose horn, worn gears or a heavy load; compare it with the others"
    else:
        verdict, remedy = Verdict.OK, ""
    return Examined(name, verdict, said, remedy, subject=Subject.HAND, data=data)


def _position(bus: FeetechBus, one: Surveyed) -> int:
    word = int.from_bytes(bus.read(one.id, FEEDBACK, 2).data, one.byte_order)
    return word if one.big_endian or word < 0x8000 else 0x8000 - word
