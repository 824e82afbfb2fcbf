"""A stage of a recipe: what is rewarded, on which hands, with which of PPO's settings; the defaults are the paper's."""

from __future__ import annotations

from dataclasses import dataclass
from math import exp

from train.actuation import IDEAL, ActuationRanges
from train.hands import HANDS, HandRanges
from train.randomise import RandomRow
from train.task import PAPER_RESET, PAPER_REWARD, ResetRanges, RewardSettings, TurningWeight


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


def constant(value: float) -> Ramp:
    """Return a ramp that is none."""
    return Ramp(value, value, 1)


PAPER_RATE, PAPER_ENTROPY = constant(3e-4), constant(1e-2)


@dataclass(frozen=True)
class Redraw:
    """How often the oldest hands of a batch give way to new ones."""

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
    """What is rewarded."""
    action_rate: Ramp | None = None
    """Weight of the squared change of the action, if it changes within the stage."""
    turning: TurningWeight | None = None
    """How a hand's turning is weighted by how that hand is doing; None rewards every turn alike."""
    drop_price: DropPrice | None = None
    """How the price of a drop follows the drops; None leaves it at the reward's."""
    actuation: ActuationRanges = IDEAL
    """What the hand does to commands and readings."""
    rows: tuple[RandomRow, ...] = ()
    """What is randomised besides the paper's table, on routed hands."""
    built: bool = False
    """Whether the hands are built ones; else they are routed."""
    hands: HandRanges = HANDS
    """Which built hands."""
    healthy: bool = False
    """Whether the built hands are drawn as the healthy population is (`model.units.plausible`); of `hands`, what a unit
    does not have still holds, the friction of the fingertips and the error of the correction."""
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
