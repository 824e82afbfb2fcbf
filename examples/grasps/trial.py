"""One grasp on one hand, through the driver, the actuation map and every byte: is the object held?"""

from __future__ import annotations

from collections.abc import Callable, Collection
from contextlib import closing
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aero import AeroHand
from aero.actuation import ActuationMap
from aero.channels import JOINT_BOX_RAD
from aero.firmware import DEFAULT_FIRMWARE
from firmware_emulator.hand import EmulatedHand
from firmware_emulator.links.in_process import InProcessLink
from model.skeleton import GRAVITY
from model.units import Unit

from .grasp import Grasp
from .object_plant import ObjectPlant

FIRMWARE = DEFAULT_FIRMWARE
SHAPING_S, CLOSING_S = 0.8, 0.8
"""Time for the channels that close before the object is there, and for those that close on it, s."""
SETTLING_S = 0.3
"""Time from letting go to the first look, gravity along the back of the hand, s."""
GRAVITY_S = 1.0
"""How long gravity acts along each direction, s."""
PUSH_N, PUSH_S = 1.0, 0.5
"""Each push, and how long it lasts; the hand is palm down meanwhile, s."""
FURTHEST_M = 0.025
"""How far an end of the object's axis may move from where it was when the hand had settled, m."""
DIRECTIONS = {
    "to the back": (0, 0, -1),
    "out of the palm": (0, 0, 1),
    "to the fingertips": (1, 0, 0),
    "to the wrist": (-1, 0, 0),
    "to the pinky": (0, 1, 0),
    "to the thumb": (0, -1, 0),
}
"""Along which gravity and pushes act, in the hand's frame."""
PALM_DOWN = "out of the palm"
CHANNEL_OF_JOINT = (*np.repeat(range(4), 3).tolist(), 4, 5, 6, 6)


@dataclass(frozen=True)
class Result:
    """What one trial came to."""

    grasp: int
    unit: str
    failure: str
    """Why it is not held; empty for a grasp that holds."""
    survived: int
    """How many of the loads, gravity first, it survived, 0 to 12."""
    moved_m: float
    """Furthest way of an end of the object's axis under those, m; until the loss for one that is lost."""
    pose: tuple[float, ...]
    """Joint angles, (16,) rad, and object, (7,), m and w x y z, when the person let go and the hand had settled."""

    @property
    def held(self) -> bool:
        """Whether it is the grasp that was asked for, and neither gravity nor a push takes the object."""
        return not self.failure


TOUCH_LOOKS, TOUCH_LOOK_S = 10, 0.01
"""How often, and how far apart, it is seen which links touch: a stiff contact comes and goes from step to step, s."""
LOOK_S = 0.05
"""Time from one look at the object to the next, s."""
NO_PUSH = np.zeros(3)


def codes_of(closure: ArrayLike, codec: ActuationMap) -> NDArray[np.uint16]:
    """Return the codes, (7,), at which a free hand's joints close by these shares, (7,) 0..1, of their travel."""
    joints = np.asarray(closure, dtype=float)[list(CHANNEL_OF_JOINT)] * JOINT_BOX_RAD[:, 1]
    codes: NDArray[np.uint16] = codec.saturating_codes(codec.angles_from_travel(codec.travel_from_joints(joints))).codes
    return codes


def hold(grasp: Grasp, unit: Unit, seed: int = 0) -> Result:
    """Make `grasp` once on an emulated hand, `unit`, let gravity turn around it, and push."""
    plant = ObjectPlant(grasp.thing, grasp.position_m(), grasp.orientation(), unit.hand)
    electronics = EmulatedHand(plant, firmware=FIRMWARE, servos=unit.servos, seed=seed)
    clock, codec = electronics.clock, ActuationMap.for_firmware(FIRMWARE)

    def wait(seconds: float) -> None:
        clock.sleep_until(clock.now() + seconds)

    with closing(electronics), AeroHand(InProcessLink(electronics), clock) as hand:
        hand.command_codes(codes_of(grasp.before(), codec))
        wait(SHAPING_S)
        plant.appear()
        hand.command_codes(codes_of(grasp.closure, codec))
        wait(CLOSING_S)
        plant.let_go()
        wait(SETTLING_S)
        links: set[str] = set()
        for _ in range(TOUCH_LOOKS):
            wait(TOUCH_LOOK_S)
            links |= plant.touching()
        return _judge(grasp, unit.name, plant, links, wait)


def _judge(
    grasp: Grasp, unit: str, plant: ObjectPlant, links: Collection[str], wait: Callable[[float], None]
) -> Result:
    settled = plant.ends()
    posture = (*plant.joint_angles().tolist(), *plant.pose().tolist())
    loads = [(f"gravity {name}", GRAVITY * np.array(way), NO_PUSH, GRAVITY_S) for name, way in DIRECTIONS.items()]
    down = GRAVITY * np.array(DIRECTIONS[PALM_DOWN])
    loads += [(f"a push {name}", down, PUSH_N * np.array(way), PUSH_S) for name, way in DIRECTIONS.items()]
    moved, survived = 0.0, 0
    failure = grasp.shortfall(links)
    for name, gravity, push, lasts_s in [] if failure else loads:
        plant.pull(gravity)
        plant.push(push)
        for _ in range(round(lasts_s / LOOK_S)):
            wait(LOOK_S)
            moved = max(moved, float(np.linalg.norm(plant.ends() - settled, axis=1).max()))
        if moved > FURTHEST_M:
            failure = f"taken by {name}"
            break
        survived += 1
    return Result(grasp.number, unit, failure, survived, moved, posture)
