"""Which built hands a policy meets in training: a range for everything in which one hand differs from the next.

The ranges span the default hand, the hand of the paper and the recorded one (`model/units`), with room on both sides.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from aero.channels import CABLES, Channel, Joint
from aero.policy.running import typical_correction
from aero.policy.settings import PolicySettings
from model.units import Unit, load_unit
from model.units.cable_correction import correction
from model.units.plausible import plausible_unit

Bounds = tuple[float, float]
Floats = NDArray[np.float64]


def _per_joint(proximal: Floats, distal: Floats) -> Floats:
    """Return a factor for every joint, (16,), from factors of the five digits' proximal and further joints."""
    fingers = np.stack([proximal[:4], distal[:4], distal[:4]], axis=1).ravel()
    return np.concatenate([fingers, [1.0, proximal[4], distal[4], distal[4]]])


DEFAULT, RECORDED = Unit(), load_unit("reference")
"""Between these are the springs. The recorded hand's ring finger and pinky close at their far joints first, the default
hand's at the near ones."""


@dataclass(frozen=True)
class HandRanges:
    """Uniform ranges; one draw a channel or joint unless said."""

    finger_take_up: Bounds = (-0.001, 0.002)
    """Cable to wind in before a finger moves, m; what a calibrated zero leaves of it."""
    cmc_take_up: Bounds = (-0.0025, 0.001)
    """The same for the thumb's CMC cable, m."""
    flexor_take_up: Bounds = (-0.0015, 0.0005)
    """The same for the thumb's flexor, m."""
    shaft_friction: Bounds = (0.001, 0.05)
    """Dry friction of gears and spool, N m at the shaft."""
    sheath_friction: Bounds = (0.2, 0.7)
    """Dry friction of a cable in its sheaths as a share of its tension: the recorded hand's take 0.43 to 0.61 and
    random units 0.37 to 0.70; that of hands without any is met on routed ones."""
    towards_recorded: Bounds = (0.0, 1.1)
    """How far the springs go from the default hand's (0) to the recorded hand's (1), one draw."""
    digit_spring_factor: Bounds = (0.8, 1.25)
    """On all springs of a digit besides, one draw a digit: the fingers of one hand differ by as much."""
    spring_factor: Bounds = (0.93, 1.07)
    """On each spring besides, one draw for the proximal joint of a digit and one for those beyond it: which of them
    closes first is for `towards_recorded` to say, so that a gait can be led from hand to hand."""
    joint_friction: Bounds = (0.0005, 0.006)
    """N m"""
    joint_damping: Bounds = (0.001, 0.006)
    """N m s/rad"""
    abduction_winding: Bounds = (0.0, 0.006)
    """Winding radius of abduction on the thumb's cables, m/rad."""
    winding_scale: Bounds = (0.97, 1.03)
    """Winding radii over those of CAD."""
    rotor_inertia: Bounds = (6.0e-4, 8.5e-4)
    """kg m², one draw."""
    no_load_speed_counts: Bounds = (7370.0, 9580.0)
    """Of the servos at full duty, counts/s, one draw; a back-EMF of 0.040 to 0.052 N m s/rad."""
    supply_ratio: Bounds = (0.9, 1.1)
    """One draw."""
    tip_friction: Bounds = (0.2, 0.8)
    """Friction of the fingertips, one draw; contact friction is the larger of the two geoms', the cube's is 0.3."""
    correction_error_m: float = 0.0005
    """By how much the correction of a cable (`training_correction`) may be wrong, on both sides, m. An assumption: the
    static error of a finger's servo alone is 0.3 mm of cable (docs/calibration.md)."""


HANDS = HandRanges()
UNNAMED_SEEDS = (2**32, 2**48)
"""Seeds of healthy hands for training: commands take 32 bits, so no hand that a policy is measured on is among them."""
TIMESTEP_S = 0.005
"""Step of the built hand in training, s; the emulated hand takes 2 ms."""


def in_training(unit: Unit) -> Unit:
    """Return the same hand at training's step, with what it needs to hold a cube.

    Its supply does not sag: by less than 1 % at the loads of a grasp, where the drawn ratio has 10 %. Its sheaths rub
    alike from closure to closure: the friction drawn for each hand spans more.
    """
    hand = replace(unit.hand, contacts=True, timestep=TIMESTEP_S, supply_sag=0.0, cable_friction_spread=0.0)
    return replace(unit, hand=hand)


def draw_hand(ranges: HandRanges, rng: np.random.Generator) -> Unit:
    """Draw one hand with the recorded hand's servos; the friction of its fingertips is drawn with its scene."""

    def channels(span: Bounds) -> Floats:
        return rng.uniform(*span, len(Channel))

    def joints(span: Bounds) -> Floats:
        return rng.uniform(*span, len(Joint))

    take_up = channels(ranges.finger_take_up)
    take_up[Channel.THUMB_ABDUCTION] = 0.0
    take_up[Channel.THUMB_CMC_FLEXION] = rng.uniform(*ranges.cmc_take_up)
    take_up[Channel.THUMB_FLEXOR] = rng.uniform(*ranges.flexor_take_up)
    far = rng.uniform(*ranges.towards_recorded)
    factor = _per_joint(*(rng.uniform(*ranges.spring_factor, (2, 5)) * rng.uniform(*ranges.digit_spring_factor, 5)))
    opened, closed = (
        factor * (np.array(there) + far * np.subtract(recorded, there))
        for there, recorded in (
            (DEFAULT.hand.spring_open, RECORDED.hand.spring_open),
            (DEFAULT.hand.spring_closed, RECORDED.hand.spring_closed),
        )
    )
    closed = np.maximum(closed, 1.02 * opened)
    rotor_inertia = float(rng.uniform(*ranges.rotor_inertia))
    servos = replace(RECORDED.servos, no_load_speed_counts=float(rng.uniform(*ranges.no_load_speed_counts)))
    hand = replace(
        DEFAULT.hand,
        rotor_inertia=(rotor_inertia,) * len(Channel),
        supply_ratio=float(rng.uniform(*ranges.supply_ratio)),
        spool_friction=tuple(channels(ranges.shaft_friction).tolist()),
        cable_friction=tuple(channels(ranges.sheath_friction).tolist()),
        cable_take_up=tuple(take_up.tolist()),
        winding_scale=tuple(channels(ranges.winding_scale).tolist()),
        abduction_winding=(
            float(rng.uniform(*ranges.abduction_winding)),
            float(rng.uniform(*ranges.abduction_winding)),
        ),
        spring_open=tuple(opened.tolist()),
        spring_closed=tuple(closed.tolist()),
        joint_friction=tuple(joints(ranges.joint_friction).tolist()),
        joint_damping=tuple(joints(ranges.joint_damping).tolist()),
    )
    return Unit("drawn", hand=hand, servos=servos)


def draw_healthy(rng: np.random.Generator) -> Unit:
    """Draw one hand of the healthy population, none of those that a command's `--seed` can name."""
    return plausible_unit(int(rng.integers(*UNNAMED_SEEDS)))


def training_correction(
    unit: Unit | None, settings: PolicySettings, rng: np.random.Generator, error_m: float = 0.0
) -> Floats:
    """Return by how much longer each channel of a hand is commanded, (7,), m, abduction rad; typical when it is None.

    As a hand is before it runs a policy (`model.units.cable_correction`), at training's step; each cable is wrong by up
    to `error_m`, uniform on both sides.
    """
    found = np.array(typical_correction() if unit is None else correction(in_training(unit), settings))
    found[list(CABLES)] += rng.uniform(-error_m, error_m, len(CABLES))
    return found
