"""A grasp without the electronics, at a coarse step and a quick pace: what the search looks at thousands of times."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from model.units import Unit

from .grasp import Grasp
from .object_plant import FAR_M, HeldObject, ObjectPlant
from .trial import CODEC, FURTHEST_M, LOADS, Pace, Result, codes_of, perform

TIMESTEP_S = 0.004
QUICK = Pace(shaping_s=0.35, closing_s=0.5, settling_s=0.2, gravity_s=0.5, push_s=0.3, hopeless_m=0.01)
SHARE = 0.74
"""Of the stall torque, which rehearsals let a blocked servo use: the board's usual limit, 700, leaves the unit
`reference` 0.83."""
SPEED = 12.0
"""At which a setpoint moves, rad/s, as the profile of firmware 0.2.0's servos does on average."""
TICK_S = 0.02
TOUCHES = 0.02
"""Share of `FAR_M` up to which a gap counts as none: 1 mm."""
WORST = -8.0
"""Margin of a grasp with which the physics failed."""
SHY = 0.1
"""How much less than a posture the digits close to see where they would meet, share of their travel."""


class DirectHand:
    """A plant whose servos get their goals at once, without bytes, bus and noise."""

    def __init__(self, plant: ObjectPlant, unit: Unit) -> None:
        self._plant = plant
        self._goals = self._setpoints = plant.angles()
        drive = unit.position_drive(SHARE)
        for shaft, setpoint in enumerate(self._setpoints.tolist()):
            plant.drive(shaft, replace(drive, setpoint=setpoint))

    def command_codes(self, codes: NDArray[np.uint16]) -> None:
        """Send the servos to the angles of `codes`, (7,)."""
        self._goals = np.asarray(CODEC.angles_from_codes(codes), dtype=float)

    def wait(self, seconds: float) -> None:
        """Let time go by, s."""
        end = self._plant.time + seconds
        while (left := end - self._plant.time) > 1e-9:
            way = self._goals - self._setpoints
            if way.any():
                self._setpoints = self._setpoints + np.clip(way, -SPEED * TICK_S, SPEED * TICK_S)
                for shaft, setpoint in enumerate(self._setpoints.tolist()):
                    self._plant.set_setpoint(shaft, setpoint)
            self._plant.advance_to(self._plant.time + (min(left, TICK_S) if way.any() else left))


def rehearse(grasp: Grasp, unit: Unit) -> Result:
    """Make `grasp` once on `unit`, much as `trial.hold` does.

    Raises:
        ArithmeticError: the physics diverged, as when the object appears inside a finger.
    """
    plant = _plant(unit, _of_one_size(grasp.thing))
    plant.begin_anew(grasp.thing, grasp.position_m(), grasp.orientation())
    hand = DirectHand(plant, unit)
    return perform(grasp, unit.name, plant, command=hand.command_codes, wait=hand.wait, pace=QUICK)


def meeting_mm(grasp: Grasp, unit: Unit) -> NDArray[np.float64]:
    """Return the middle between the tips of the thumb and of the fingers that must touch, (3,) mm, hand without object.

    A grasp without the thumb: the middle between the fingertips and the palm.
    """
    plant = _plant(unit, _of_one_size(grasp.thing))
    plant.begin_anew(grasp.thing, grasp.position_m(), grasp.orientation())
    hand = DirectHand(plant, unit)
    hand.command_codes(codes_of([max(0.0, share - SHY) for share in grasp.closure]))
    hand.wait(QUICK.shaping_s)
    fingers = [plant.tip(part) for part in grasp.touching if part not in ("thumb", "palm")]
    other = plant.tip("thumb") if "thumb" in grasp.touching else plant.tip("palm", "")
    middle: NDArray[np.float64] = 500.0 * (np.mean(fingers, axis=0) + other)
    return middle


@lru_cache(maxsize=64)
def _plant(unit: Unit, thing: HeldObject) -> ObjectPlant:
    return ObjectPlant(thing, np.zeros(3), (1.0, 0.0, 0.0, 0.0), replace(unit.hand, timestep=TIMESTEP_S))


def _of_one_size(thing: HeldObject) -> HeldObject:
    """Return a thing of the same form, the same for all sizes, so that one plant does for them."""
    return replace(thing, size_mm=tuple(round(30.0 * edge / thing.size_mm[0], 1) for edge in thing.size_mm))


def margin(result: Result) -> float:
    """Return how well one hand holds: above 0 all loads are survived, 1 is an object that does not move at all.

    Below 0 the share of the loads that take the object, negative; below -1 a digit does not touch: later, or, below
    -2, not even while the person holds the object.
    """
    if not result.failure:
        return 1.0 - result.moved_m / FURTHEST_M
    at_hand, later = (min(gap / FAR_M, 5.0) for gap in result.gaps_m)
    if result.failure.startswith("taken"):
        return result.survived / len(LOADS) - 1.0
    return -1.1 - 0.15 * later if at_hand < TOUCHES else -2.0 - at_hand


def worth(grasp: Grasp, units: Sequence[Unit]) -> float:
    """Return the mean margin over hands; those behind the first on which a digit misses count as bad as that one."""
    margins: list[float] = []
    for unit in units:
        try:
            margins.append(margin(rehearse(grasp, unit)))
        except ArithmeticError:
            margins.append(WORST)
        if margins[-1] < -1.0:
            margins += [margins[-1]] * (len(units) - len(margins))
            break
    return float(np.mean(margins))
