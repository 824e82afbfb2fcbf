"""The reward, term by term, and when an episode ends (paper eq. (reward))."""

from __future__ import annotations

from dataclasses import dataclass, fields
from math import inf

import numpy as np
from numpy.typing import NDArray

from aero.actuation.arrays import Array, namespace
from aero.channels import Channel, Joint
from train.task.grasp import NOMINAL_JOINTS
from train.task.signals import Signals

FALL_HEIGHT = -0.05
"""Height of the cube's centre below which it is lost, world frame, m."""

HELD_RAD = 0.1
"""How far the thumb's abduction may stand beyond what it was sent in the last two periods and still hold, rad; less
than half of what the guard allows (0.26, 15 % of its window)."""

Each = float | NDArray[np.float64]
"""A number for all environments, or one for each, (batch,)."""

PRICES = ("cube_speed", "airborne")
"""Terms that price how the cube moves, which a hand that does not turn it never pays."""


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
    airborne: Each = 0.0
    """Of the share of the control period's physics steps in which nothing touches the cube; not a term of the
    paper's."""
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
    rotation_cap_rad_s: Each = inf
    """Rotation faster than this earns no more; the paper has no cap."""
    affordable: Each = inf
    """Share of what turning brings in that the prices on the cube's motion take at most, see `reward`."""


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


def side_by_side(first: RewardSettings, count: int, second: RewardSettings, total: int) -> RewardSettings:
    """Return settings of `total` environments: the first `count` are rewarded by `first`, the others by `second`."""

    def each(one: Each, other: Each) -> NDArray[np.float64]:
        return np.where(np.arange(total) < count, one, other)

    weights = {
        field.name: each(getattr(first.weights, field.name), getattr(second.weights, field.name))
        for field in fields(Weights)
    }
    return RewardSettings(
        Weights(**weights),
        each(first.rotation_cap_rad_s, second.rotation_cap_rad_s),
        each(first.affordable, second.affordable),
    )


def fallen(cube_height: Array) -> Array:
    """Return whether the cube is lost, given the height of its centre (m, world frame)."""
    return cube_height < FALL_HEIGHT


def terms(
    period: Signals,
    joints: Array,
    *,
    last_lengths: Array,
    action: Array,
    last_action: Array,
    sent: Array,
    period_s: float,
    rotation_cap_rad_s: Array,
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
        rotation_cap_rad_s: rotation that is rewarded at most, rad/s, a number or (...,).

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


def reward(values: dict[str, Array], rewarded: RewardSettings, period_s: float, settled: Array | bool = True) -> Array:
    """Return the weighted sum of the terms times the control period, (...) or (batch,).

    Prices on the cube's motion count where it has `settled`, bool (...): how it drops into the hand is none of the
    policy's doing, and would take most of what is affordable.

    Environments with an affordable share are a group: where their prices would take more than that share of what
    turning brings in (what rotation earns, less what changing the action costs), mean against mean, all of the group's
    prices shrink to it. However dear bouncing is, a gait that turns the cube then earns more than holding it still, but
    for the risk of losing it.
    """
    weighted = {field.name: getattr(rewarded.weights, field.name) * values[field.name] for field in fields(Weights)}
    xp = namespace(values["rotation"])
    prices = xp.where(settled, sum(weighted.pop(name) for name in PRICES), 0.0)
    income = weighted["rotation"] + weighted["action_rate"]
    return (sum(weighted.values()) + prices * _shrunk(prices, income, rewarded.affordable)) * period_s


def _shrunk(prices: Array, income: Array, affordable: Each) -> Array:
    """Return the factor, 0 to 1, by which each environment's prices, which are negative, are to shrink."""
    xp = namespace(prices)
    group = np.isfinite(affordable)
    if not group.any():
        return 1.0
    share = np.where(group, affordable, 0.0)
    # The state of a broken simulation is not finite, and must not reach the others.
    sound = xp.isfinite(prices) & xp.isfinite(income)
    allowed = xp.sum(xp.where(sound, share * income, 0.0))
    paid = xp.sum(xp.where(sound & group, -prices, 0.0))
    nothing = 1e-9  # hands that pay nothing must not divide by it
    return xp.where(group, xp.clip(allowed / xp.maximum(paid, nothing), 0.0, 1.0), 1.0)
