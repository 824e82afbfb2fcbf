"""One grasp on one hand, through the driver, the actuation map and every byte: is the object held?"""

from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aero import AeroHand
from aero.actuation import ActuationMap
from aero.channels import JOINT_BOX_RAD, Joint
from aero.firmware import DEFAULT_FIRMWARE
from firmware_emulator.hand import EmulatedHand
from firmware_emulator.links.in_process import InProcessLink
from model.units import Unit
from simulator.skeleton import GRAVITY

from .grasp import Grasp
from .object_plant import ObjectPlant
from .skin import Skin

FIRMWARE = DEFAULT_FIRMWARE
CODEC = ActuationMap.for_firmware(FIRMWARE)
PUSH_N = 1.0
"""Each push, N; the hand is palm down meanwhile."""
FURTHEST_M = 0.025
"""How far an end of the object's axis may move from where it was when the hand had settled, m."""
SLIPPING_M = 0.005
"""How far it has gone when it is seen which joint gives way, m."""
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
LOADS = (
    *((f"gravity {name}", way, (0, 0, 0)) for name, way in DIRECTIONS.items()),
    *((f"a push {name}", DIRECTIONS[PALM_DOWN], way) for name, way in DIRECTIONS.items()),
)
"""Name, direction of gravity, direction of the push."""
CHANNEL_OF_JOINT = (*np.repeat(range(4), 3).tolist(), 4, 5, 6, 6)
TOUCH_LOOKS, TOUCH_LOOK_S = 10, 0.01
"""How often, and how far apart, it is seen which links touch: a stiff contact comes and goes from step to step, s."""
LOOK_S = 0.05
"""Time from one look at the object to the next, s."""
SHAPING_S, CLOSING_S = 0.8, 0.8
"""For the channels that close before the object is there, and for those that close on it, s."""
SETTLING_S = 0.3
"""From letting go to the first look, gravity along the back of the hand, s."""
GRAVITY_S, PUSH_S = 1.0, 0.5
"""How long gravity acts along each direction, and each push, s."""


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
    gave_way: str = ""
    """The joint that had moved most from the settled posture when the lost object had gone `SLIPPING_M`."""

    @property
    def held(self) -> bool:
        """Whether it is the grasp that was asked for, and neither gravity nor a push takes the object."""
        return not self.failure


def codes_of(closure: ArrayLike, codec: ActuationMap = CODEC) -> NDArray[np.uint16]:
    """Return the codes, (7,), at which a free hand's joints close by these shares, (7,) 0..1, of their travel."""
    joints = np.asarray(closure, dtype=float)[list(CHANNEL_OF_JOINT)] * JOINT_BOX_RAD[:, 1]
    codes: NDArray[np.uint16] = codec.saturating_codes(codec.angles_from_travel(codec.travel_from_joints(joints))).codes
    return codes


def hold(grasp: Grasp, unit: Unit, skin: Skin = Skin.PLASTIC, seed: int = 0) -> Result:
    """Make `grasp` once on an emulated hand, `unit` with a skin, let gravity turn around it, and push."""
    plant = ObjectPlant(grasp.thing, grasp.position_m(), grasp.orientation(), unit.hand, skin)
    electronics = EmulatedHand(plant, firmware=FIRMWARE, servos=unit.servos, seed=seed)
    clock = electronics.clock

    def wait(seconds: float) -> None:
        clock.sleep_until(clock.now() + seconds)

    with closing(electronics), AeroHand(InProcessLink(electronics), clock) as hand:
        return _perform(grasp, unit.name, plant, command=hand.command_codes, wait=wait)


def _perform(
    grasp: Grasp,
    unit: str,
    plant: ObjectPlant,
    *,
    command: Callable[[NDArray[np.uint16]], None],
    wait: Callable[[float], None],
) -> Result:
    command(codes_of(grasp.before()))
    wait(SHAPING_S)
    plant.appear()
    now = 0.0
    for at, closure in grasp.closing_up():
        wait(at - now)
        now = at
        command(codes_of(closure))
    wait(CLOSING_S)
    plant.let_go()
    wait(SETTLING_S)
    links: set[str] = set()
    for _ in range(TOUCH_LOOKS):
        wait(TOUCH_LOOK_S)
        links |= plant.touching()
    settled, joints = plant.ends(), plant.joint_angles()
    posture = (*joints.tolist(), *plant.pose().tolist())
    failure, moved, survived = grasp.shortfall(links), 0.0, 0
    for name, gravity, push in () if failure else LOADS:
        plant.pull(GRAVITY * np.array(gravity))
        plant.push(PUSH_N * np.array(push))
        gave_way = ""
        for _ in range(round((PUSH_S if any(push) else GRAVITY_S) / LOOK_S)):
            wait(LOOK_S)
            gone = float(np.linalg.norm(plant.ends() - settled, axis=1).max())
            moved = max(moved, gone)
            if gone > SLIPPING_M and not gave_way:
                gave_way = _most_moved(plant.joint_angles() - joints)
            if moved > FURTHEST_M:
                failure = f"taken by {name}"
                return Result(grasp.number, unit, failure, survived, moved, posture, gave_way)
        survived += 1
    return Result(grasp.number, unit, failure, survived, moved, posture)


def _most_moved(change: NDArray[np.float64]) -> str:
    """Say which joint moved most; `change` (16,) rad."""
    joint = Joint(int(np.abs(change).argmax()))
    way = "closes" if change[joint] > 0.0 else "opens"
    return f"{joint.label} {way} by {np.degrees(abs(change[joint])):.0f}°"
