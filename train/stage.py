"""A stage of a recipe: what is rewarded, on which hands, with which of PPO's settings; the defaults are the paper's."""

from __future__ import annotations

from dataclasses import dataclass

from train.actuation import IDEAL, ActuationRanges
from train.drop_price import DropPrice
from train.hands import HANDS, HandRanges
from train.randomise import RandomRow
from train.task.grasp import PAPER_RESET, ResetRanges
from train.task.reward import PAPER_REWARD, RewardSettings, TurningWeight


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
    redraw: Redraw | None = None
    """How built hands are replaced within the stage."""
    any_cube: bool = False
    """Whether every hand has a cube of its own (`model.cubes`), for training and measuring, or the paper's."""
    cube_reach: tuple[float, float] = (1.0, 1.0)
    """How far the training cubes have gone from the paper's (0) to any (1), one draw a hand; those that measure are
    any."""
    tail_share: float = 0.0
    """Share of the training cubes that have one property from the tail (`model.cubes.TAILS`)."""
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
        if not self.built and (self.redraw or self.tail_share):
            raise ValueError(f"stage {self.name!r}: only built hands are redrawn and have cubes from the tail")
