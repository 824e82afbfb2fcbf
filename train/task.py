"""Cube task from the start of an episode to its reward, as pure functions over NumPy or JAX arrays.

In order: the start, the sensors, the reward terms and the end of an episode (paper eq. (reward)), and an episode
without its physics. All backends share this module: `train.environment` runs it in JAX over native MuJoCo or MJX,
`train.evaluation` in NumPy. The parts common to training and deployment (observation, action) are in
`aero.policy.task`.

Sources of the start: paper section "Domain randomisation" (last paragraph); the grasp's joint angles and the centre of
the cube's draws from the released environment `AeroCubeRotateZAxis`.
"""

from dataclasses import dataclass, fields
from itertools import pairwise
from math import inf
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aero.actuation.arrays import Array, namespace
from aero.channels import JOINT_BOX_RAD, OBSERVATION_ORDER, Channel, Joint
from aero.policy.settings import PAPER_TRAINING, PolicySettings
from aero.policy.task import ActionMemory, ShownAction, observe, targets
from simulator.scene import LOST_HEIGHT_M, LOST_UNTOUCHED_S
from train import actuation
from train.actuation import IDEAL, ActuationRanges, Parameters, ServoState

NOMINAL_JOINTS = np.array(
    [
        *(1.573, 0.347, 0.352),
        *(1.573, 0.401, 0.406),
        *(1.573, 0.365, 0.370),
        *(1.573, 0.515, 0.520),
        *(0.746, 0.260, -0.002, 1.075),
    ]
)
"""Joint angles with the cube in the nominal grasp, (16,) rad, order of `Joint`."""
CUBE_CENTRE = np.array([0.1, 0.0, 0.05])
"""Centre of the drawn cube positions in the world, m."""
UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])

STATE_POSITIONS = len(Joint) + 7
STATE_VELOCITIES = len(Joint) + 6


@dataclass(frozen=True)
class ResetRanges:
    """Spread of the starts around the nominal grasp."""

    joint_std_rad: float = 0.1
    """Standard deviation of each joint angle; the draw is clipped to the joint box."""
    cube_offset_m: float = 0.01
    """Half width of the uniform cube offset along each axis."""
    random_orientation: bool = True
    """Whether the cube's orientation is uniform over SO(3); otherwise upright."""


PAPER_RESET = ResetRanges()
NOMINAL_RESET = ResetRanges(joint_std_rad=0.0, cube_offset_m=0.0, random_orientation=False)


def start_positions(ranges: ResetRanges, joint_normal: Array, cube_uniform: Array, orientation_normal: Array) -> Array:
    """Return generalised positions of a start.

    Args:
        ranges: spread of the starts.
        joint_normal: (..., 16) standard normal draws.
        cube_uniform: (..., 3) draws from [-1, 1].
        orientation_normal: (..., 4) standard normal draws; their direction is uniform over SO(3).

    Returns:
        (..., 23): joint angles (rad), cube position (m), cube orientation (unit quaternion w x y z).
    """
    xp = namespace(joint_normal)
    joints = xp.clip(NOMINAL_JOINTS + ranges.joint_std_rad * joint_normal, JOINT_BOX_RAD[:, 0], JOINT_BOX_RAD[:, 1])
    cube = CUBE_CENTRE + ranges.cube_offset_m * cube_uniform
    norm = xp.sqrt(xp.sum(orientation_normal**2, axis=-1, keepdims=True))
    direction = orientation_normal / norm
    orientation = direction if ranges.random_orientation else 0 * direction + UPRIGHT
    return xp.concatenate([joints, cube, orientation], axis=-1)


def draw_starts(rng: np.random.Generator, count: int, ranges: ResetRanges) -> NDArray[np.float64]:
    """Draw `count` starts, (count, 23)."""
    starts: NDArray[np.float64] = start_positions(
        ranges,
        rng.standard_normal((count, len(Joint))),
        rng.uniform(-1, 1, (count, 3)),
        rng.standard_normal((count, 4)),
    )
    return starts


SENSOR_SIZES = {
    "lengths": len(Channel),
    "forces": len(Channel),
    "fingertips": 5 * 3,
    "cube_position": 3,
    "cube_orientation": 4,
    "cube_linear_velocity": 3,
    "cube_angular_velocity": 3,
    "cube_contacts": 1,
}
"""Sensor blocks of a training scene in the order of its sensor vector, with their widths."""
_EDGES = np.cumsum([0, *SENSOR_SIZES.values()])
SENSOR_COUNT = int(_EDGES[-1])
_SLICES = {name: slice(a, b) for name, (a, b) in zip(SENSOR_SIZES, pairwise(_EDGES), strict=True)}
_TO_COMMAND_ORDER = np.argsort(OBSERVATION_ORDER)

GRASP_REFERENCE = np.array([0.11, 0.0, 0.0])
"""Origin of the critic's cube position error: the grasp site of the released model, world frame, m."""
CRITIC_SIZE = 81
HAND_FACTS = 15
"""Number of constants of a hand and its cube that the critic knows beside the state (`train.hand_stock`)."""


class Signals(NamedTuple):
    """Signals of one step; leading axes are free. Sensors lag the state one physics step, as in the released task."""

    lengths: Array
    """Channel values, (..., 7) in command order, m, abduction rad."""
    forces: Array
    """Actuator forces, (..., 7) in command order, N, abduction N m."""
    fingertips: Array
    """Fingertip positions in the palm's frame, thumb last, (..., 15), m."""
    cube_position: Array
    """Position in the world frame, (..., 3), m."""
    cube_orientation: Array
    """Unit quaternion w x y z, (..., 4)."""
    cube_linear_velocity: Array
    """Linear velocity in the world frame, (..., 3), m/s."""
    cube_angular_velocity: Array
    """Angular velocity in the world frame, (..., 3), rad/s."""
    cube_contacts: Array
    """Number of contacts of the cube, (..., 1)."""


def unpack(sensors: Array) -> Signals:
    """Split sensor vectors (..., 43) into named signals."""
    blocks = {name: sensors[..., part] for name, part in _SLICES.items()}
    return Signals(**blocks | {"lengths": blocks["lengths"][..., _TO_COMMAND_ORDER]})


def critic_state(observation: Array, positions: Array, velocities: Array, signals: Signals) -> Array:
    """Return the privileged state (paper section "Observation and action").

    Args:
        observation: the policy's observation, (..., 14).
        positions: generalised positions, (..., 23), joints first.
        velocities: generalised velocities, (..., 22), joints first.
        signals: of the same step.

    Returns:
        (..., 81): observation, joint angles and velocities, actuator forces, fingertips, cube position error,
        orientation, angular velocity, linear velocity.
    """
    joints = len(Joint)
    return namespace(observation).concatenate(
        [
            observation,
            positions[..., :joints],
            velocities[..., :joints],
            signals.forces,
            signals.fingertips,
            signals.cube_position - GRASP_REFERENCE,
            signals.cube_orientation,
            signals.cube_angular_velocity,
            signals.cube_linear_velocity,
        ],
        axis=-1,
    )


HELD_RAD = 0.1
"""Tolerance of the thumb abduction beyond its targets of the last two periods, rad; above it the thumb is pushed.

Less than half of the guard's threshold (0.26 rad, 15 % of the abduction window).
"""

Each = float | Array
"""One number for all environments, or one per environment, (batch,)."""


@dataclass(frozen=True)
class Weights:
    """Weights of the reward terms; the defaults are the paper's."""

    rotation: Each = 1.0
    """Weight of the cube's angular velocity about the vertical, mean over the control period, s/rad."""
    fall: Each = -100.0
    action_rate: Each = -1.0
    cube_speed: Each = 0.0
    """Weight of the cube's squared linear speed, mean over the control period, s²/m²."""
    pushed: Each = 0.0
    """Weight of the thumb abduction's deflection beyond `HELD_RAD`, 1/rad; not in the paper."""
    pose: Each = 0.0
    """Weight of the squared joint distance from the nominal grasp, 1/rad²."""
    effort: Each = 0.0
    """Weight of the squared actuator forces, 1/N²."""
    energy: Each = 0.0
    """Weight of the absolute power between actuators and hand, 1/W."""


@dataclass(frozen=True)
class RewardSettings:
    """Settings of the reward."""

    weights: Weights = Weights()
    rotation_cap_rad_s: float = inf
    """Saturation of the rewarded rotation rate, rad/s; the paper has none."""


PAPER_REWARD = RewardSettings()


@dataclass(frozen=True)
class TurningWeight:
    """Weight of the rotation reward by the running mean of a hand's rate.

    A fast hand earns little by more speed, so the gait need not risk the cube; a slow hand earns more, so that training
    does not neglect it.
    """

    memory_steps: int = 400
    """Memory of the running mean of the rate, control steps."""
    enough_rad_s: float = 0.9
    """Rate above which the weight is `least`, rad/s."""
    fading_rad_s: float = 0.4
    """Width below `enough_rad_s` over which the weight falls, rad/s."""
    least: float = 0.1
    """Weight of a sufficiently fast rotation."""
    slow_rad_s: tuple[float, float] = (0.6, 0.2)
    """Numerator and offset of the weight for slow rotation, numerator / (offset + rate)."""
    slow_bounds: tuple[float, float] = (0.4, 2.0)
    """Lowest and highest weight for slow rotation."""

    def of(self, rate_rad_s: Array) -> Array:
        """Return the weight for running means of the rate, (...)."""
        xp = namespace(rate_rad_s)
        numerator, offset = self.slow_rad_s
        fast = xp.clip((self.enough_rad_s - rate_rad_s) / self.fading_rad_s, self.least, 1.0)
        # Backward rotation is weighted like a resting cube; the weight never becomes negative.
        slow = xp.clip(numerator / (offset + xp.maximum(rate_rad_s, 0.0)), *self.slow_bounds)
        return fast * slow


HARDLY_RAD_S = 0.1
"""Threshold of the rate, rad/s; below it the hand counts as not turning the cube (over a minute per turn)."""


@dataclass(frozen=True)
class LossRule:
    """Definition of a lost cube; the defaults are the paper's."""

    height_m: float = -0.05
    """Threshold of the height of the cube's centre, world frame, m; below it the cube is lost. Source: paper, section
    "Learning In-Hand Cube Rotation"."""
    untouched_s: float = inf
    """Threshold of the time without any contact, s; above it the cube is lost."""

    def lost(self, height_m: Array, untouched_s: Array) -> Array:
        """Return whether cubes of these heights and times without contact are lost, (...)."""
        return (height_m < self.height_m) | (untouched_s > self.untouched_s)


OUT_OF_THE_HAND = LossRule(LOST_HEIGHT_M, LOST_UNTOUCHED_S)
"""Rule of emulated hands: below the paper's height a gait may still carry the cube."""


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
    lost: Array,
) -> dict[str, Array]:
    """Return every term before weighting, each with the leading axes of `joints`.

    Args:
        period: signals of a control period's substeps, leading axes (..., substeps).
        joints: joint angles at the end of the period, (..., 16), rad.
        last_lengths: channel values at the end of the previous period, (..., 7).
        action: action of the period, (..., 7).
        last_action: action of the previous period, (..., 7).
        sent: maximum of the targets of both actions, (..., 7), so that a moving thumb does not count as pushed.
        period_s: length of the period, s.
        rotation_cap_rad_s: saturation of the rewarded rotation rate, rad/s.
        lost: whether the cube is lost at the end of the period, (...).

    The rotation rate is averaged over the period, because a policy would learn bursts at the instants of sampling.
    """
    xp = namespace(joints)
    travel_speed = (period.lengths[..., -1, :] - last_lengths) / period_s
    forces = period.forces[..., -1, :]
    away = (period.lengths[..., -1, :] - sent)[..., Channel.THUMB_ABDUCTION]
    return {
        "rotation": xp.minimum(xp.mean(period.cube_angular_velocity[..., 2], axis=-1), rotation_cap_rad_s),
        "fall": xp.where(lost, 1.0, 0.0),
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


PHYSICS_STEP_S = 0.010


@dataclass(frozen=True)
class Task:
    """Definition of the task; the defaults are the paper's.

    Raises:
        ValueError: a control period that is not a whole number of physics steps, or actuation out of range.
    """

    settings: PolicySettings = PAPER_TRAINING
    """Nominal grasp, scales, noise and rate."""
    shown_action: ShownAction = ShownAction.LAST
    rewarded: RewardSettings = PAPER_REWARD
    reset: ResetRanges = PAPER_RESET
    loss: LossRule = LossRule()
    actuation: ActuationRanges = IDEAL
    """Actuation between commands, cables and readings."""
    episode_steps: int = 500

    def __post_init__(self) -> None:
        if abs(self.substeps * PHYSICS_STEP_S - self.settings.period_s) > 1e-9:
            raise ValueError(f"a control period must be whole {PHYSICS_STEP_S} s steps, got {self.settings.period_s} s")
        actuation.check(self.actuation, self.settings.period_s)

    @property
    def substeps(self) -> int:
        """Number of physics steps per control period."""
        return round(self.settings.period_s / PHYSICS_STEP_S)


class Episode(NamedTuple):
    """State of an episode outside its physics; leading axes are free."""

    memory: ActionMemory
    parameters: Parameters
    servo: ServoState
    lengths: Array
    """Simulated channel values at the end of the last period, (..., 7)."""
    periods: Array
    untouched_s: Array
    """Time since the cube's last contact, s."""


class EpisodeOutcome(NamedTuple):
    """Result of a control period; leading axes as in the episode."""

    observation: Array
    """Actor's observation, (..., 14)."""
    critic: Array
    """Critic's privileged state, (..., 81)."""
    reward: Array
    lost: Array
    terms: dict[str, Array]
    """Reward terms before weighting."""


def begin(task: Task, sensors: Array, uniform: Array) -> Episode:
    """Start episodes with the servos at rest at the nominal targets.

    Args:
        task: the task.
        sensors: sensors of the start, (..., 43).
        uniform: draws from [0, 1] for the actuation, (..., `actuation.DRAWS`).
    """
    lengths = unpack(sensors).lengths
    return Episode(
        memory=ActionMemory.empty(lengths),
        parameters=actuation.parameters(task.actuation, uniform),
        servo=actuation.at_rest(0 * lengths + np.array(task.settings.nominal)),
        lengths=lengths,
        periods=0 * lengths[..., 0],
        untouched_s=0 * lengths[..., 0],
    )


def command(task: Task, episode: Episode, action: Array) -> tuple[Episode, Array]:
    """Convert an action (..., 7) to the controls of the period's physics steps, (..., substeps, 7)."""
    nominal, scale = np.array(task.settings.nominal), np.array(task.settings.scale)
    servo, controls = actuation.drive(
        episode.servo,
        targets(action, nominal, scale),
        episode.parameters,
        nominal,
        steps=task.substeps,
        step_s=PHYSICS_STEP_S,
        ranges=task.actuation,
    )
    return episode._replace(memory=episode.memory.after(action), servo=servo), controls


def observed(task: Task, episode: Episode, noise: Array) -> Array:
    """Return the observation, (..., 14), for sensor noise drawn from [-1, 1], (..., 7)."""
    nominal = np.array(task.settings.nominal)
    reading = actuation.read(episode.lengths, episode.parameters, nominal, task.actuation.counts)
    return observe(reading + np.array(task.settings.noise) * noise, episode.memory.shown(task.shown_action))


def finish(
    task: Task, episode: Episode, sensors: Array, *, positions: Array, velocities: Array, noise: Array
) -> tuple[Episode, EpisodeOutcome]:
    """Finish a control period: return the updated episode and the period's outcome.

    Args:
        task: the task.
        episode: as `command` left it.
        sensors: of every physics step of the period, (..., substeps, 43).
        positions: generalised positions at its end, (..., 23).
        velocities: generalised velocities at its end, (..., 22).
        noise: draws from [-1, 1], (..., 7).
    """
    period, period_s = unpack(sensors), task.settings.period_s
    nominal, scale = np.array(task.settings.nominal), np.array(task.settings.scale)
    sent = [targets(action, nominal, scale) for action in episode.memory]
    last = Signals(*(part[..., -1, :] for part in period))
    xp = namespace(sensors)
    touched = (period.cube_contacts[..., 0] > 0).any(axis=-1)
    untouched_s = xp.where(touched, 0.0, episode.untouched_s + period_s)
    lost = task.loss.lost(last.cube_position[..., 2], untouched_s)
    values = terms(
        period,
        positions,
        last_lengths=episode.lengths,
        action=episode.memory.last,
        last_action=episode.memory.before_last,
        sent=xp.maximum(*sent),
        period_s=period_s,
        rotation_cap_rad_s=task.rewarded.rotation_cap_rad_s,
        lost=lost,
    )
    episode = episode._replace(lengths=last.lengths, periods=episode.periods + 1, untouched_s=untouched_s)
    observation = observed(task, episode, noise)
    return episode, EpisodeOutcome(
        observation=observation,
        critic=critic_state(observation, positions, velocities, last),
        reward=reward(values, task.rewarded, period_s),
        lost=lost,
        terms=values,
    )
