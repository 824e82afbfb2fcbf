"""Hands as a builder gets them wrong: ten mistakes, each put where it would be made on a physical hand."""

import dataclasses
from collections.abc import Callable
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from aero.actuation import ActuationMap
from aero.channels import Channel, Joint
from firmware_emulator.hand import EmulatedHand
from firmware_emulator.links.in_process import InProcessLink
from hil.targets.emulated_hand import build_emulated
from hil.targets.opening import OpenRequest, in_process
from model.units import Unit, load_unit


class Rewired:
    """A plant whose shafts reach the mechanics in another order or turning the other way."""

    def __init__(self, plant, order=range(7), signs=(1,) * 7):
        self.plant, self.order, self.signs = plant, list(order), np.array(signs, float)

    @property
    def time(self):
        return self.plant.time

    def advance_to(self, t):
        self.plant.advance_to(t)

    def drive(self, shaft, drive):
        sign = self.signs[shaft]
        self.plant.drive(
            self.order[shaft], dataclasses.replace(drive, setpoint=sign * drive.setpoint, torque=sign * drive.torque)
        )

    def set_setpoint(self, shaft, setpoint):
        self.plant.set_setpoint(self.order[shaft], self.signs[shaft] * setpoint)

    def angles(self):
        return self.signs * self.plant.angles()[self.order]

    def speeds(self):
        return self.signs * self.plant.speeds()[self.order]

    def efforts(self):
        return self.signs * self.plant.efforts()[self.order]


class LossyLink(InProcessLink):
    """A cable that now and then swallows a reply."""

    def __init__(self, electronics, every):
        super().__init__(electronics)
        self._reads, self._every = 0, every

    def read(self, size, timeout):
        data = super().read(size, timeout)
        self._reads += bool(data)
        return b"" if data and self._reads % self._every == 0 else data


@dataclass(frozen=True)
class BuildError:
    """One mistake."""

    rewire: Callable | None = None
    """Changes what the servos' shafts turn."""
    hand: dict = dataclasses.field(default_factory=dict)
    """Changed mechanics: field of `BuiltHandParameters` to {index: value}."""
    electronics: Callable[[EmulatedHand], None] = lambda electronics: None
    """Changes the servos."""
    prepare: Callable = lambda target: None
    """Done by the owner before the test."""
    calibration: str | None = None
    """Command window that the owner believes in."""
    link: Callable = InProcessLink


def swapped(first, second):
    order = list(range(7))
    order[first], order[second] = second, first
    return lambda plant: Rewired(plant, order)


def reversed_shaft(channel):
    return lambda plant: Rewired(plant, signs=[-1 if i == channel else 1 for i in range(7)])


def rename(servo, new_id):
    def change(electronics):
        electronics.servos[servo].id = new_id

    return change


def heat(servo, celsius):
    def change(electronics):
        electronics.servos[servo].feedback.temperature_c = celsius

    return change


BUILD_ERRORS = {
    "two cables swapped": BuildError(swapped(Channel.THUMB_CMC_FLEXION, Channel.THUMB_FLEXOR)),
    "cable wound backwards": BuildError(reversed_shaft(Channel.RING)),
    "cable slack by 20 mm": BuildError(hand={"cable_take_up": {Channel.MIDDLE: 0.020}}),
    "stiff joint": BuildError(hand={"joint_friction": {Joint.INDEX_PIP: 0.25}}),
    "trimmed servo": BuildError(prepare=lambda target: target.hand.trim(Channel.MIDDLE, 5)),
    "servo of the wrong ID": BuildError(electronics=rename(4, 9)),
    "wrong firmware window": BuildError(calibration="unshifted"),
    "reversed abduction": BuildError(reversed_shaft(Channel.THUMB_ABDUCTION)),
    "hot servo": BuildError(electronics=heat(5, 67.0)),
    "lossy cable": BuildError(link=lambda electronics: LossyLink(electronics, every=9)),
}


@contextmanager
def spoiled(error: BuildError, unit: str = "reference"):
    """A target with one build error."""
    good = load_unit(unit)
    hand = good.hand
    for name, changes in error.hand.items():
        values = list(getattr(hand, name))
        for index, value in changes.items():
            values[index] = value
        hand = dataclasses.replace(hand, **{name: tuple(values)})
    changed: Unit = dataclasses.replace(good, hand=hand)
    electronics, plant = build_emulated(changed, firmware="0.2.0", hand="right", seed=1, rewire=error.rewire)
    error.electronics(electronics)
    codec = ActuationMap.for_firmware("0.2.0", error.calibration)
    request = OpenRequest("emulated", codec, "0.2.0", "right", changed, 1)
    with in_process(request, electronics, plant, error.link(electronics)) as target:
        error.prepare(target)
        yield target
