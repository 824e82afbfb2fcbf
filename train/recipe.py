"""Recipes: everything that decides what a training run becomes, except its seed. Stages are data."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, replace
from enum import Enum
from hashlib import sha256
from math import exp, inf

import numpy as np
from numpy.typing import NDArray

from aero.policy.settings import PAPER_TRAINING
from train.actuation import BUS, IDEAL, SERVOS, ActuationRanges
from train.hands import HANDS, HandRanges
from train.randomise import SERVO_ROWS, RandomRow
from train.simulator import Floats
from train.task import (
    HARDLY_RAD_S,
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
    """A value that goes evenly from `first` to `last`, and stays there."""

    first: float
    last: float
    steps: int
    """Environment steps of the stage that it takes."""

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
    """Hands that are replaced each time."""


@dataclass(frozen=True)
class DropPrice:
    """The price of a drop as a Lagrange multiplier of the hazard: dearer while cubes are dropped too often.

    A fixed price makes one gait drop and another hold still, and which one depends on the seed; the multiplier asks for
    a hazard instead. A constraint on a rate in reinforcement learning: Stooke, Achiam and Abbeel 2020, "Responsive
    Safety in Reinforcement Learning by PID Lagrangian Methods", its integral part.
    """

    begin: float = 100.0
    """Price of a drop at the beginning of the stage, in the reward's units."""
    bounds: tuple[float, float] = (60.0, 400.0)
    """Lowest and highest price."""
    hazard_per_s: float = 0.005
    """Drops a second that are asked for; with 0.5 % a second 93 % of the cubes are kept for 15 s while exploring."""
    gain: float = 0.006
    """Relative change of the price an update, for each relative excess of the hazard."""
    excess: float = 2.0
    """Bound of that relative excess, on both sides."""
    slowest_rad_s: float = 0.15
    """Mean rate below which drops are not what is wrong, and the price only falls."""
    relief: float = 0.01
    """Relative fall of the price an update while it does."""

    def after(self, price: float, *, hazard_per_s: float, rate_rad_s: float) -> float:
        """Return the price after an update, from the running means of hazard and rate."""
        over = min(max(hazard_per_s / self.hazard_per_s - 1.0, -self.excess), self.excess)
        change = self.gain * over if rate_rad_s > self.slowest_rad_s else -self.relief
        low, high = self.bounds
        return min(max(price * exp(change), low), high)


@dataclass(frozen=True)
class TrainingStage:
    """A stretch of a run with one reward and one set of PPO's settings."""

    name: str
    """For people."""
    steps: int
    """Environment steps."""
    rewarded: RewardSettings = PAPER_REWARD
    """Reward settings."""
    action_rate: Ramp | None = None
    """Weight of the squared change of the action, if it changes within the stage."""
    turning: TurningWeight | None = None
    """How a hand's turning is weighted by how that hand is doing; None rewards every turn alike."""
    drop_price: DropPrice | None = None
    """How the price of a drop follows the drops; None leaves it at the reward's."""
    actuation: ActuationRanges = IDEAL
    """Actuation between commands, cables and readings."""
    rows: tuple[RandomRow, ...] = ()
    """What is randomised besides the paper's table, on routed hands."""
    built: bool = False
    """Whether the hands are built ones; else they are routed."""
    hands: HandRanges = HANDS
    """Which built hands."""
    healthy: bool = False
    """Whether the built hands are drawn as the healthy population is (`model.units.plausible`); of `hands`, what a unit
    does not have still holds, the friction of the fingertips and the error of the correction."""
    typical: bool = False
    """Whether built hands have the typical correction, as one without a twin runs a policy; else their exact one."""
    redraw: Redraw | None = None
    """How built hands are replaced within the stage."""
    any_cube: bool = False
    """Whether every hand has a cube of its own (`model.scene`), for training and measuring, or the paper's."""
    cube_reach: tuple[float, float] = (1.0, 1.0)
    """How far the training cubes have gone from the paper's (0) to any (1), one draw a hand; those that measure are
    any."""
    tail_share: float = 0.0
    """Share of the training cubes that have one property from the tail (`model.scene.TAILS`)."""
    reset: ResetRanges = PAPER_RESET
    """Where episodes start."""
    episode_steps: int = 500
    """Control steps after which an episode is cut off and another start is drawn."""
    staggered: bool = False
    """Whether the first episodes have ages already, so that not all end at once."""
    unroll: int = 40
    """Control steps between two updates."""
    clipping: float = 0.3
    """PPO's clipping parameter."""
    discount: float = 0.97
    """A control step."""
    learning_rate: Ramp = PAPER_RATE
    """Adam's for the policy."""
    value_learning_rate: Ramp = PAPER_RATE
    """Adam's for the value network."""
    gradient_norm: tuple[float, float] | None = None
    """Bounds of the gradients' norms of policy and value network."""
    entropy_cost: Ramp = PAPER_ENTROPY
    """Weight of the policy's entropy."""
    frozen_updates: int = 0
    """Updates at the beginning in which only the value network learns."""
    measured: int = 100
    """Hands that a checkpoint is measured on, one episode each."""

    def __post_init__(self) -> None:
        if not self.built and (self.redraw or self.tail_share or self.healthy):
            raise ValueError(
                f"stage {self.name!r}: only built hands are redrawn, healthy ones or have cubes from the tail"
            )


CONFIDENCE_Z = 1.645
"""One-sided 95 %."""


@dataclass(frozen=True)
class Goal:
    """What a checkpoint should reach before its rate alone counts."""

    survival: float = 0.95
    """Share of episodes that keep the cube."""
    survival_price_rad_s: float = 5.0
    """Price of the whole share; in a choice, of each lost cube."""
    enough_rad_s: float = inf
    """Rate from which a hand's speed counts no more in a choice."""
    slow_price_rad_s: float = 0.0
    """Price in a choice of a hand that hardly turns the cube."""

    def score(self, rate_rad_s: float, survival: float) -> float:
        """Return what checkpoints are chosen by: the rate, less what falling short costs."""
        return rate_rad_s - self.survival_price_rad_s * max(0.0, self.survival - survival)

    def worth(self, rates_rad_s: Floats, kept: NDArray[np.bool_]) -> Floats:
        """Return what each trial (trials,) is worth where checkpoints are chosen among, rad/s."""
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
    """One way to train a policy with Brax PPO; the PPO defaults are the paper's."""

    name: str
    """Name of the policy it makes."""
    task: Task
    """What is trained for; the stages say what is rewarded, and on which hands."""
    stages: tuple[TrainingStage, ...]
    """One after another; each continues with the networks of the one before, and has its own best checkpoint."""
    goal: Goal = Goal()
    """Criterion for the choice of checkpoints."""
    environments: int = 256
    """Parallel environments."""
    minibatches: int = 4
    """Minibatches a batch; together they hold one unroll of every environment."""
    epochs: int = 4
    """Passes over a batch."""
    checkpoint_steps: int = 204_800
    """Environment steps between checkpoints."""
    gae: float = 0.95
    """Lambda of the generalised advantage estimate."""
    hidden: tuple[int, ...] = (512, 256, 128)
    """Widths of the hidden layers of policy and value network."""
    stuck_steps: int = 2_000_000
    """Environment steps that a run may take to get going; some settle into holding the cube still."""
    stuck_rate_rad_s: float = 0.15
    """Rotation that the best checkpoint must have reached by then; the run is begun again with another seed if not."""

    def __post_init__(self) -> None:
        if self.environments % self.minibatches:
            raise ValueError(f"{self.environments} environments must divide into minibatches, got {self.minibatches}")

    def task_in(self, stage: TrainingStage) -> Task:
        """Return what is trained for in one of the stages."""
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
        """Return the recipe for a run that begins with the parameters of another."""
        return replace(self, stages=self.stages[-1:])

    def with_steps(self, steps: int) -> Recipe:
        """Return the recipe for a run of `steps`, with at least ten checkpoints where the batches allow."""
        batch = self.environments * max(stage.unroll for stage in self.stages)
        stages = tuple(replace(stage, steps=round(stage.steps * steps / self.steps)) for stage in self.stages)
        return replace(self, stages=stages, checkpoint_steps=max(batch, min(self.checkpoint_steps, steps // 10)))


def _plain(value: object) -> object:
    """Return an array, a NumPy scalar or a member of an enum as JSON has it."""
    if isinstance(value, Enum):
        return value.name
    assert isinstance(value, np.ndarray | np.generic), type(value)
    return value.tolist()


PAPER = Recipe("paper", Task(), (TrainingStage("paper", 10_000_000),))
"""The paper's task, reward and settings, nothing added."""

BOLDEST = RewardSettings(Weights(action_rate=-0.1))
"""For the beginning: at the paper's price exploring costs more than a gait earns, and many runs hold the cube still."""

HALF_TORQUE = replace(PAPER_TRAINING, noise=(0.002, 0.002, 0.002, 0.002, 0.02, 0.002, 0.002), torque_limit=0.5)
"""The paper's training settings with half the servos' torque, and 2 mm of noise for 5, still 145 encoder counts."""

NEAR_DEFAULT = replace(HANDS, towards_recorded=(0.0, 0.5))
"""For the beginning: a gait is found sooner where the springs are alike."""

AS_PLACED = ResetRanges(joint_std_rad=0.04, cube_offset_m=0.006, random_orientation=False)
"""A cube that is placed upright, as people do, with three times the error of the trials through the bytes."""

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
"""All springs, and cubes from the paper's to any: the gait that was found turns the paper's cube at 1.0 rad/s on hands
with all springs, but any cube at 0.2 rad/s, and with nothing in between it is given up for holding still. A slow hand's
turning counts twice. A hand that gives way at its thumb would be stopped by the guard, so that costs. The value network
learns the new prices before the policy moves: without, most of the gait is lost in the first 0.1 M steps."""


STEADY = Recipe(
    "steady",
    Task(settings=HALF_TORQUE),
    (
        TrainingStage("find", 800_000, BOLDEST, actuation=BUS, built=True, hands=NEAR_DEFAULT, measured=16),
        ANY_CUBE,
        replace(
            ANY_CUBE,
            name="constrain",
            steps=4_400_000,
            healthy=True,
            typical=True,
            hands=replace(HANDS, correction_error_m=0.001),
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
        ),
    ),
    goal=Goal(survival=0.98, enough_rad_s=1.0, slow_price_rad_s=1.0),
    checkpoint_steps=102_400,
    stuck_steps=800_000,
    stuck_rate_rad_s=0.4,
)
"""For the hand, in three stages (docs/training.md): the gait is found where it is easy, with the paper's cube on built
hands of like springs; it is led to all springs and cubes; and drops are brought down while slow hands are sped up."""

RECIPES = {recipe.name: recipe for recipe in (STEADY, PAPER)}


def on_routed_hands(recipe: Recipe) -> Recipe:
    """Return the recipe for MJX, which steps no built hands: routed ones behind servos take their place."""
    stages = tuple(
        replace(stage, built=False, redraw=None, tail_share=0.0, healthy=False, actuation=SERVOS, rows=SERVO_ROWS)
        if stage.built
        else stage
        for stage in recipe.stages
    )
    return replace(recipe, stages=stages)


def on_gpu(recipe: Recipe) -> Recipe:
    """Return the recipe at the paper's scale: 8192 environments, 32 minibatches, 3e8 steps; routed hands only."""
    large = replace(on_routed_hands(recipe), environments=8192, minibatches=32, stuck_steps=30_000_000)
    return replace(large.with_steps(300_000_000), checkpoint_steps=5_242_880)
