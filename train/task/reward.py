"""The reward, term by term, and when an episode ends (paper eq. (reward))."""

from __future__ import annotations

from dataclasses import dataclass, fields
from math import inf

from aero.actuation.arrays import Array, namespace
from aero.channels import Channel, Joint
from model.cubes import LOST_HEIGHT_M
from train.task.grasp import NOMINAL_JOINTS
from train.task.signals import Signals

HELD_RAD = 0.1
"""How far the thumb's abduction may stand beyond what it was sent in the last two periods and still hold, rad; less
than half of what the guard allows (0.26, 15 % of its window)."""

Each = float | Array
"""A number for all environments, or one for each, (batch,)."""


@dataclass(frozen=True)
class Weights:
    """Weights of the reward's terms; the defaults are the paper's."""

    rotation: Each = 1.0
    """Of the cube's angular velocity about the vertical, mean over the control period, s/rad."""
    fall: Each = -100.0
    """Of losing the cube."""
    action_rate: Each = -1.0
    """Of the squared change of the action."""
    cube_speed: Each = 0.0
    """Of the cube's squared linear speed, mean over the control period, s²/m²."""
    pushed: Each = 0.0
    """Of how far the thumb's abduction is pushed away beyond `HELD_RAD`, 1/rad; not a term of the paper's."""
    pose: Each = 0.0
    """Of the squared distance of the joints from the nominal grasp, 1/rad²."""
    effort: Each = 0.0
    """Of the squared actuator forces, 1/N²."""
    energy: Each = 0.0
    """Of the power that the actuators exchange with the hand, absolute, 1/W."""


@dataclass(frozen=True)
class RewardSettings:
    """What is rewarded."""

    weights: Weights = Weights()
    """Of the terms."""
    rotation_cap_rad_s: float = inf
    """Rotation faster than this earns no more; the paper has no cap."""


PAPER_REWARD = RewardSettings()


@dataclass(frozen=True)
class TurningWeight:
    """How much a hand's turning counts, by the running mean of its rate.

    A hand that turns fast enough earns little by turning faster, so that the gait need not risk the cube for it; a slow
    one earns more, so that the hands at the slow end are not given up.
    """

    memory_steps: int = 400
    """Control steps that the running mean of the rate looks back on."""
    enough_rad_s: float = 0.9
    """Rate from which more speed earns the least."""
    fading_rad_s: float = 0.4
    """Width below it over which the weight falls to that."""
    least: float = 0.1
    """Weight of turning that is fast enough."""
    slow_rad_s: tuple[float, float] = (0.6, 0.2)
    """Numerator and offset of the weight of slow turning, numerator / (offset + rate)."""
    slow_bounds: tuple[float, float] = (0.4, 2.0)
    """Lowest and highest weight of slow turning."""

    def of(self, rate_rad_s: Array) -> Array:
        """Return the weight for running means of the rate, (...)."""
        xp = namespace(rate_rad_s)
        numerator, offset = self.slow_rad_s
        fast = xp.clip((self.enough_rad_s - rate_rad_s) / self.fading_rad_s, self.least, 1.0)
        # A cube that is turned back has no slower weight than one that lies still, and never a negative one.
        slow = xp.clip(numerator / (offset + xp.maximum(rate_rad_s, 0.0)), *self.slow_bounds)
        return fast * slow


def fallen(cube_height: Array) -> Array:
    """Return whether the cube is lost, given the height of its centre (m, world frame)."""
    return cube_height < LOST_HEIGHT_M


def terms(
    period: Signals,
    joints: Array,
    *,
    last_lengths: Array,
    action: Array,
    last_action: Array,
    sent: Array,
    period_s: float,
    rotation_cap_rad_s: float,
) -> dict[str, Array]:
    """Return every term before weighting, each with the leading axes of `joints`.

    Args:
        period: the signals of a control period's substeps, leading axes (..., substeps).
        joints: joint angles at its end, (..., 16), rad.
        last_lengths: channel values at the end of the period before, (..., 7).
        action: the period's action, (..., 7).
        last_action: the one before, (..., 7).
        sent: the higher of what the two ask for, (..., 7); a thumb that is still on its way is not pushed.
        period_s: length of the period, s.
        rotation_cap_rad_s: rotation that is rewarded at most, rad/s.

    The rotation is the mean over the period: sampled once a period, a policy learns to burst at the sampling.
    """
    xp = namespace(joints)
    travel_speed = (period.lengths[..., -1, :] - last_lengths) / period_s
    forces = period.forces[..., -1, :]
    away = (period.lengths[..., -1, :] - sent)[..., Channel.THUMB_ABDUCTION]
    return {
        "rotation": xp.minimum(xp.mean(period.cube_angular_velocity[..., 2], axis=-1), rotation_cap_rad_s),
        "fall": xp.where(fallen(period.cube_position[..., -1, 2]), 1.0, 0.0),
        "action_rate": xp.sum((action - last_action) ** 2, axis=-1),
        "cube_speed": xp.mean(xp.sum(period.cube_linear_velocity**2, axis=-1), axis=-1),
        "airborne": xp.mean(xp.where(period.cube_contacts[..., 0] > 0, 0.0, 1.0), axis=-1),
        "pushed": xp.maximum(away - HELD_RAD, 0.0),
        "pose": xp.sum((joints[..., : len(Joint)] - NOMINAL_JOINTS) ** 2, axis=-1),
        "effort": xp.sum(forces**2, axis=-1),
        "energy": xp.sum(xp.abs(forces * travel_speed), axis=-1),
    }


def reward(values: dict[str, Array], rewarded: RewardSettings, period_s: float) -> Array:
    """Return the weighted sum of the terms times the control period, (...)."""
    return sum(getattr(rewarded.weights, field.name) * values[field.name] for field in fields(Weights)) * period_s
