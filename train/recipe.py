"""Recipes: all inputs of a training run except its seed, with its stages as data."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, replace
from enum import Enum
from hashlib import sha256
from math import exp, inf

import numpy as np
from numpy.typing import NDArray

from aero.floats import Floats
from aero.policy.settings import PAPER_TRAINING
from train.actuation import BUS, IDEAL, SERVOS, ActuationRanges
from train.hands import HANDS, HandRanges
from train.randomise import SERVO_ROWS, RandomRow
from train.task import (
    HARDLY_RAD_S,
    OUT_OF_THE_HAND,
    PAPER_RESET,
    PAPER_REWARD,
    ResetRanges,
    RewardSettings,
    Task,
    TurningWeight,
    Weights,
)


@dataclass(frozen=True)
class Ramp:
    """Linear change from `first` to `last`, then constant."""

    first: float
    last: float
    steps: int
    """Duration of the change, environment steps from the start of the stage."""

    def at(self, done: int) -> float:
        """Return the value after `done` environment steps of the stage."""
        return self.first + (self.last - self.first) * min(1.0, done / self.steps)


PAPER_RATE, PAPER_ENTROPY = Ramp(3e-4, 3e-4, 1), Ramp(1e-2, 1e-2, 1)


@dataclass(frozen=True)
class Redraw:
    """Replacement rate of the oldest hands of a batch."""

    every: int
    """Updates of the networks between two redraws."""
    hands: int


@dataclass(frozen=True)
class DropPrice:
    """Price of a drop as a Lagrange multiplier that holds the drop hazard at a target.

    Source: the integral part of the controller in Stooke, Achiam and Abbeel 2020, "Responsive Safety in Reinforcement
    Learning by PID Lagrangian Methods".
    """

    # A fixed price was rejected: depending on the seed, the gait under it drops the cube or stops turning it.
    begin: float = 100.0
    """Price of a drop at the beginning of the stage, in the reward's units."""
    bounds: tuple[float, float] = (60.0, 400.0)
    """Lowest and highest price of a drop, in the reward's units."""
    hazard_per_s: float = 0.005
    """Target of the drop hazard while exploring, 1/s; at 0.5 % a second, 93 % of the cubes are kept for 15 s."""
    gain: float = 0.006
    """Relative change of the price per update and per relative excess of the hazard over its target."""
    excess: float = 2.0
    """Saturation of the hazard's relative excess, on both sides."""
    slowest_rad_s: float = 0.15
    """Threshold of the mean rotation rate, rad/s; below it the price falls, since a high price suppresses rotation."""
    relief: float = 0.01
    """Relative fall of the price per update while the rate is below `slowest_rad_s`."""

    def after(self, price: float, *, hazard_per_s: float, rate_rad_s: float) -> float:
        """Return the price of a drop after an update, from the running means of drop hazard and rotation rate."""
        over = min(max(hazard_per_s / self.hazard_per_s - 1.0, -self.excess), self.excess)
        change = self.gain * over if rate_rad_s > self.slowest_rad_s else -self.relief
        low, high = self.bounds
        return min(max(price * exp(change), low), high)


@dataclass(frozen=True)
class TrainingStage:
    """Part of a run with one reward and one set of PPO settings."""

    name: str
    steps: int
    rewarded: RewardSettings = PAPER_REWARD
    action_rate: Ramp | None = None
    """Weight of the squared change of the action; None for the constant weight of `rewarded`."""
    turning: TurningWeight | None = None
    """Weight of the rotation reward by a hand's mean rate; None for a constant weight."""
    drop_price: DropPrice | None = None
    """Adaptive price of a drop; None for the constant weight of `rewarded`."""
    actuation: ActuationRanges = IDEAL
    """Actuation between commands, cables and readings."""
    rows: tuple[RandomRow, ...] = ()
    """Additional rows to the paper's randomisation table, for routed hands."""
    built: bool = False
    """True for built hands, False for routed ones."""
    hands: HandRanges = HANDS
    healthy: bool = False
    """True to draw built hands from the healthy population (`model.units.plausible`); fingertip friction and correction
    error still come from `hands`."""
    typical: bool = False
    """True for the typical cable correction, as for a physical hand without a twin; False for each hand's own."""
    redraw: Redraw | None = None
    """Replacement of built hands within the stage; None keeps them."""
    any_cube: bool = False
    """True for a random cube per hand (`simulator.scene`), in training and evaluation; False for the paper's cube."""
    cube_reach: tuple[float, float] = (1.0, 1.0)
    """Range of the interpolation from the paper's cube (0) to a random one (1), one draw a training hand."""
    tail_share: float = 0.0
    """Fraction of the training cubes with one property from `simulator.scene.TAILS`."""
    reset: ResetRanges = PAPER_RESET
    from_running: float = 0.0
    """Share of the episodes that begin from a state of a running one, 5 to 120 s after the cube was placed."""
    episode_steps: int = 500
    staggered: bool = False
    """True for random initial ages of the first episodes, so that they do not all end at once."""
    unroll: int = 40
    """Control steps between two updates."""
    clipping: float = 0.3
    discount: float = 0.97
    learning_rate: Ramp = PAPER_RATE
    value_learning_rate: Ramp = PAPER_RATE
    gradient_norm: tuple[float, float] | None = None
    entropy_cost: Ramp = PAPER_ENTROPY
    frozen_updates: int = 0
    measured: int = 100
    """Number of evaluation hands per checkpoint, one episode each."""

    def __post_init__(self) -> None:
        if not self.built and (self.redraw or self.tail_share or self.healthy):
            raise ValueError(f"stage {self.name!r}: `redraw`, `healthy` and tail cubes need `built=True`")


CONFIDENCE_Z = 1.645
"""Standard score of a one-sided 95 % bound."""


@dataclass(frozen=True)
class Goal:
    """Criteria for ranking checkpoints: rate, survival, share of slow hands."""

    survival: float = 0.95
    """Target fraction of episodes that keep the cube; `score` penalises only a shortfall."""
    survival_price_rad_s: float = 5.0
    """Penalty of `score` per unit of missing survival, and of `worth` per lost cube, rad/s."""
    enough_rad_s: float = inf
    """Saturation of a trial's rate in `worth`, rad/s."""
    slow_price_rad_s: float = 0.0
    """Penalty of `worth` for a trial slower than `HARDLY_RAD_S`, rad/s."""

    def score(self, rate_rad_s: float, survival: float) -> float:
        """Return the score of a checkpoint during training, rad/s: its rate minus the penalty for low survival."""
        return rate_rad_s - self.survival_price_rad_s * max(0.0, self.survival - survival)

    def worth(self, rates_rad_s: Floats, kept: NDArray[np.bool_]) -> Floats:
        """Return the value of each trial (trials,) for the final selection, rad/s."""
        slow = rates_rad_s < HARDLY_RAD_S
        capped = np.minimum(rates_rad_s, self.enough_rad_s)
        worth: Floats = capped - self.survival_price_rad_s * ~kept - self.slow_price_rad_s * slow
        return worth

    def bound(self, rates_rad_s: Floats, kept: NDArray[np.bool_]) -> float:
        """Return the one-sided lower 95 % bound of the mean worth of trials, rad/s; arrays are (trials,)."""
        worth = self.worth(rates_rad_s, kept)
        return float(worth.mean() - CONFIDENCE_Z * worth.std(ddof=1) / np.sqrt(len(worth)))


@dataclass(frozen=True)
class Recipe:
    """Settings of a training run with Brax PPO; the PPO defaults are the paper's."""

    name: str
    task: Task
    """Task definition; each stage replaces its reward, starts, actuation and episode length."""
    stages: tuple[TrainingStage, ...]
    """Stages in order; each continues with the networks of its predecessor and selects its own best checkpoint."""
    goal: Goal = Goal()
    environments: int = 256
    minibatches: int = 4
    """Number of minibatches into which one unroll of all environments is split."""
    epochs: int = 4
    """Passes over a batch."""
    checkpoint_steps: int = 204_800
    gae: float = 0.95
    """Lambda of the generalised advantage estimate."""
    hidden: tuple[int, ...] = (512, 256, 128)
    """Widths of the hidden layers of policy and value network."""
    stuck_steps: int = 2_000_000
    """Environment steps after which the run is checked for being stuck; some policies only hold the cube still."""
    stuck_rate_rad_s: float = 0.15
    """Threshold of the best checkpoint's rate at `stuck_steps`, rad/s; below it the run restarts with another seed."""

    def __post_init__(self) -> None:
        if self.environments % self.minibatches:
            raise ValueError(f"{self.environments} environments must divide into minibatches, got {self.minibatches}")

    def task_in(self, stage: TrainingStage) -> Task:
        """Return the task of a stage."""
        return replace(
            self.task,
            rewarded=stage.rewarded,
            reset=stage.reset,
            actuation=stage.actuation,
            episode_steps=stage.episode_steps,
        )

    @property
    def fingerprint(self) -> str:
        """SHA-256 of the recipe's values as canonical JSON, without the names of its classes."""
        values = json.dumps(asdict(self), sort_keys=True, separators=(",", ":"), default=_plain)
        return sha256(values.encode()).hexdigest()

    @property
    def steps(self) -> int:
        """Environment steps of the whole run."""
        return sum(stage.steps for stage in self.stages)

    def last_stage(self) -> Recipe:
        """Return the recipe with its last stage only, for a run that starts from a trained checkpoint."""
        return replace(self, stages=self.stages[-1:])

    def with_steps(self, steps: int) -> Recipe:
        """Return the recipe scaled to `steps`, with at least ten checkpoints if the batch size permits."""
        batch = self.environments * max(stage.unroll for stage in self.stages)
        stages = tuple(replace(stage, steps=round(stage.steps * steps / self.steps)) for stage in self.stages)
        return replace(self, stages=stages, checkpoint_steps=max(batch, min(self.checkpoint_steps, steps // 10)))


def _plain(value: object) -> object:
    """Convert an array, a NumPy scalar or an enum member for JSON."""
    if isinstance(value, Enum):
        return value.name
    assert isinstance(value, np.ndarray | np.generic), type(value)
    return value.tolist()


PAPER = Recipe("paper", Task(), (TrainingStage("paper", 10_000_000),))

BOLDEST = RewardSettings(Weights(action_rate=-0.1))
"""Reward of the first stage. At the paper's action-rate weight, exploration costs more than a gait earns, so many runs
end in holding the cube still."""

HALF_TORQUE = replace(PAPER_TRAINING, noise=(0.002, 0.002, 0.002, 0.002, 0.02, 0.002, 0.002), torque_limit=0.5)
"""Paper's training settings with half the servo torque and a noise of 2 mm (145 encoder counts) instead of 5 mm."""

NEAR_DEFAULT = replace(HANDS, towards_recorded=(0.0, 0.5))
"""Hands of the first stage; with similar springs a gait is found sooner."""

AS_PLACED = ResetRanges(joint_std_rad=0.04, cube_offset_m=0.006, random_orientation=False)
"""Starts with an upright cube, as placed manually, with three times the placement error of the evaluation trials."""

ANY_CUBE = TrainingStage(
    "spread",
    1_500_000,
    RewardSettings(Weights(fall=-60.0, action_rate=-0.1, pushed=-2.0), rotation_cap_rad_s=2.0),
    turning=TurningWeight(),
    actuation=BUS,
    built=True,
    redraw=Redraw(every=10, hands=40),
    any_cube=True,
    cube_reach=(0.0, 1.0),
    reset=AS_PLACED,
    episode_steps=300,
    staggered=True,
    frozen_updates=8,
    measured=16,
)
"""Second stage: the full range of springs, and cubes between the paper's and random ones.

The gait of the first stage turns the paper's cube at 1.0 rad/s on these hands, but random cubes at 0.2 rad/s. Without
intermediate cubes training gives up the gait and holds the cube still. Rotation on slow hands has a higher weight.
Deflection of the thumb abduction costs reward, because the guard would stop such a hand. The value network is trained
first: otherwise most of the gait is lost within the first 0.1 M steps.
"""


CONSTRAIN = replace(
    ANY_CUBE,
    name="constrain",
    steps=4_400_000,
    healthy=True,
    typical=True,
    hands=replace(HANDS, correction_error_m=0.0),
    rewarded=RewardSettings(Weights(pushed=-2.0)),
    action_rate=Ramp(-0.1, -0.2, 1_000_000),
    redraw=Redraw(every=20, hands=40),
    drop_price=DropPrice(),
    cube_reach=(1.0, 1.0),
    tail_share=0.5,
    unroll=20,
    clipping=0.2,
    discount=0.985,
    learning_rate=Ramp(2e-4, 1e-4, 2_000_000),
    entropy_cost=Ramp(1e-2, 3e-3, 2_000_000),
    gradient_norm=(1.0, 5.0),
)
"""Third stage: drops are reduced, and slow hands turn faster."""

ENDURE = replace(
    CONSTRAIN,
    name="endure",
    steps=4_000_000,
    typical=False,
    hands=replace(HANDS, correction_error_m=0.0009),
    action_rate=None,
    rewarded=RewardSettings(Weights(action_rate=-0.2, pushed=-2.0)),
    drop_price=DropPrice(begin=200.0, bounds=(150.0, 800.0), hazard_per_s=0.0003),
    from_running=0.5,
    episode_steps=1200,
    discount=0.99,
    learning_rate=Ramp(1e-4, 5e-5, 3_000_000),
    entropy_cost=Ramp(3e-3, 1e-3, 2_000_000),
    frozen_updates=30,
)
"""Fourth stage: minutes with a cube, on hands whose cables were measured within 0.9 mm.

Half of the episodes begin within a running one. The price of a drop cannot fall below 150: the target of 0.03 % a
second is below what exploration reaches, since ten minutes at 95 % need 0.0085 %.
"""


STEADY = Recipe(
    "steady",
    Task(settings=HALF_TORQUE, loss=OUT_OF_THE_HAND),
    (
        TrainingStage("find", 800_000, BOLDEST, actuation=BUS, built=True, hands=NEAR_DEFAULT, measured=16),
        ANY_CUBE,
        CONSTRAIN,
        ENDURE,
    ),
    goal=Goal(survival=0.98, enough_rad_s=1.0, slow_price_rad_s=1.0),
    checkpoint_steps=102_400,
    stuck_steps=800_000,
    stuck_rate_rad_s=0.15,
)
"""Recipe of the shipped policy, in four stages (docs/training.md).

Find a gait with the paper's cube on built hands with similar springs; extend it to all springs and cubes; reduce drops
and speed up slow hands; hold the cube for minutes on hands whose cables were measured.
"""

RECIPES = {recipe.name: recipe for recipe in (STEADY, PAPER)}


ROUTED = "-routed"
"""Suffix of the name of a recipe whose built hands are replaced by routed ones."""


def on_routed_hands(recipe: Recipe) -> Recipe:
    """Return the recipe for MJX, with routed hands behind servos instead of built hands, which MJX cannot step.

    A recipe with built hands becomes another task and gets another name.
    """
    stages = tuple(
        replace(stage, built=False, redraw=None, tail_share=0.0, healthy=False, actuation=SERVOS, rows=SERVO_ROWS)
        if stage.built
        else stage
        for stage in recipe.stages
    )
    built = any(stage.built for stage in recipe.stages)
    return replace(recipe, name=recipe.name + ROUTED if built else recipe.name, stages=stages)


def on_gpu(recipe: Recipe) -> Recipe:
    """Return the recipe at the paper's scale: 8192 environments, 32 minibatches, 3e8 steps; routed hands only."""
    large = replace(on_routed_hands(recipe), environments=8192, minibatches=32, stuck_steps=30_000_000)
    return replace(large.with_steps(300_000_000), checkpoint_steps=5_242_880)
