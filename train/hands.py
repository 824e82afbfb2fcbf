"""Built hands for training: a uniform range for each property in which hands differ.

The ranges span the default hand, the paper's hand and the recorded one (`model/units`), with a margin on both sides.
"""

from dataclasses import dataclass, replace

import numpy as np

from aero.channels import Channel, Joint
from aero.floats import Floats
from aero.policy.settings import PolicySettings
from model.units import Unit, load_unit
from model.units.cable_correction import correction
from model.units.plausible import plausible_unit

Bounds = tuple[float, float]


def _per_joint(proximal: Floats, distal: Floats) -> Floats:
    """Return a factor per joint, (16,), from factors of the five digits' proximal and further joints."""
    fingers = np.stack([proximal[:4], distal[:4], distal[:4]], axis=1).ravel()
    return np.concatenate([fingers, [1.0, proximal[4], distal[4], distal[4]]])


DEFAULT, RECORDED = Unit(), load_unit("reference")
"""Ends of the spring range.

The recorded hand's ring finger and pinky close at the far joints first, the default hand's at the near ones.
"""


@dataclass(frozen=True)
class HandRanges:
    """Uniform ranges; one draw per channel or joint unless noted."""

    finger_take_up: Bounds = (-0.001, 0.002)
    """Take-up of a finger's cable after zeroing, m."""
    cmc_take_up: Bounds = (-0.0025, 0.001)
    """Take-up of the thumb's CMC cable after zeroing, m."""
    flexor_take_up: Bounds = (-0.0015, 0.0005)
    """Take-up of the thumb's flexor cable after zeroing, m."""
    shaft_friction: Bounds = (0.001, 0.05)
    """Dry friction of gears and spool, N m at the shaft."""
    sheath_friction: Bounds = (0.2, 0.7)
    """Dry friction of a cable in its sheaths, as a fraction of the tension.

    The recorded hand has 0.43 to 0.61, random units 0.37 to 0.70; routed hands cover the case without friction.
    """
    towards_recorded: Bounds = (0.0, 1.1)
    """Spring interpolation from the default hand (0) to the recorded hand (1), one draw."""
    digit_spring_factor: Bounds = (0.8, 1.25)
    """Additional spring factor of a digit, one draw per digit; fingers of one hand differ as much."""
    spring_factor: Bounds = (0.93, 1.07)
    """Additional spring factor, one draw for a digit's proximal joint and one for its further joints.

    Kept small so that `towards_recorded` alone decides which joint closes first, and a gait transfers between hands.
    """
    joint_friction: Bounds = (0.0005, 0.006)
    """Dry friction of a joint, N m."""
    joint_damping: Bounds = (0.001, 0.006)
    """Viscous damping of a joint, N m s/rad."""
    abduction_winding: Bounds = (0.0, 0.006)
    """Winding radius of abduction on the thumb's cables, m/rad."""
    winding_scale: Bounds = (0.97, 1.03)
    """Ratio of the winding radii to the CAD values."""
    rotor_inertia: Bounds = (6.0e-4, 8.5e-4)
    """Rotor inertia at the shaft, kg m², one draw."""
    no_load_speed_counts: Bounds = (7370.0, 9580.0)
    """No-load speed of the servos at full duty, counts/s, one draw; equals a back-EMF of 0.040 to 0.052 N m s/rad."""
    supply_ratio: Bounds = (0.9, 1.1)
    """Ratio of the supply voltage to nominal, one draw."""
    pad_friction: Bounds = (0.4, 1.1)
    """Friction of the silicone pads, one draw; the population has 0.5 to 1.0."""
    pad_patch: Bounds = (2.0e-3, 3.4e-3)
    """Radius of a pad's contact patch, m, one draw."""
    pad_compliance: Bounds = (0.05e-3, 0.7e-3)
    """Indentation of a pad per force, m/N, one draw."""
    correction_error_m: float = 0.0005
    """Half width of a cable correction's error (`training_correction`), m.

    An assumption: the static error of a finger's servo alone is 0.3 mm of cable (docs/calibration.md).
    """


HANDS = HandRanges()
UNNAMED_SEEDS = (2**32, 2**48)
"""Seed range of healthy hands for training; disjoint from the 32-bit seeds of commands, and so from evaluation hands.
"""
TIMESTEP_S = 0.005
"""Physics step of the built hand in training, s; the emulated hand uses 2 ms."""


def in_training(unit: Unit) -> Unit:
    """Return the hand at training's physics step, with contacts for the cube.

    The supply does not sag: less than 1 % at grasp loads, against 10 % in the drawn ratio. Sheath friction is constant
    between closures: the range drawn for each hand is wider.
    """
    mechanics = replace(unit.hand, contacts=True, timestep=TIMESTEP_S, supply_sag=0.0, cable_friction_spread=0.0)
    return replace(unit, hand=mechanics)


def draw_hand(ranges: HandRanges, rng: np.random.Generator) -> Unit:
    """Draw one hand with the recorded hand's servos."""

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
    mechanics = replace(
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
        pad_friction=float(rng.uniform(*ranges.pad_friction)),
        pad_patch=float(rng.uniform(*ranges.pad_patch)),
        pad_compliance=float(rng.uniform(*ranges.pad_compliance)),
        joint_friction=tuple(joints(ranges.joint_friction).tolist()),
        joint_damping=tuple(joints(ranges.joint_damping).tolist()),
    )
    return Unit("drawn", hand=mechanics, servos=servos)


def draw_healthy(rng: np.random.Generator) -> Unit:
    """Draw a hand of the healthy population from a seed that no command's `--seed` can name."""
    return plausible_unit(int(rng.integers(*UNNAMED_SEEDS)))


def training_correction(unit: Unit, settings: PolicySettings) -> Floats:
    """Return a hand's exact cable correction at training's physics step, (7,), m, abduction rad."""
    return correction(in_training(unit), settings)
