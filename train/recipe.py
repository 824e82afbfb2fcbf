"""Recipes: everything that decides what a training run becomes, except its seed."""

from __future__ import annotations

from dataclasses import dataclass, replace

from train.actuation import HAND
from train.task.episode import Task
from train.task.reward import RewardSettings, Weights


@dataclass(frozen=True)
class Stuck:
    """When a run is given up and begun again with another seed: some settle into holding the cube still."""

    steps: int = 2_000_000
    """Environment steps that a run may take to get going."""
    rate_rad_s: float = 0.15
    """Rotation that the best checkpoint must have reached by then."""


@dataclass(frozen=True)
class Recipe:
    """One way to train a policy with Brax PPO; the PPO defaults are the paper's."""

    name: str
    """Name of the policy it makes."""
    task: Task
    """What is trained for."""
    survival_goal: float
    """Share of episodes that a checkpoint should keep; each point below costs 5 rad/s in the choice of the best."""
    environments: int = 256
    """Parallel environments."""
    minibatches: int = 4
    """Minibatches a batch; together they hold one unroll of every environment."""
    unroll: int = 40
    """Control steps an unroll."""
    epochs: int = 4
    """Passes over a batch."""
    steps: int = 10_000_000
    """Environment steps of the whole run."""
    checkpoint_steps: int = 204_800
    """Environment steps between checkpoints."""
    learning_rate: float = 3e-4
    """Adam's."""
    discount: float = 0.97
    """A control step."""
    entropy_cost: float = 1e-2
    """Weight of the policy's entropy."""
    clipping: float = 0.3
    """PPO's clipping parameter."""
    gae: float = 0.95
    """Lambda of the generalised advantage estimate."""
    hidden: tuple[int, ...] = (512, 256, 128)
    """Widths of the hidden layers of policy and value network."""
    stuck: Stuck = Stuck()
    """When to begin again."""

    def __post_init__(self) -> None:
        if self.environments % self.minibatches:
            raise ValueError(f"{self.environments} environments must divide into minibatches, got {self.minibatches}")

    def with_steps(self, steps: int) -> Recipe:
        """Return the recipe for a run of `steps`, with at least ten checkpoints where the batches allow."""
        batch = self.environments * self.unroll
        return replace(self, steps=steps, checkpoint_steps=max(batch, min(self.checkpoint_steps, steps // 10)))


FAST = Recipe("fast", Task(), survival_goal=0.95)
"""For the record in simulation: the paper's task, without a servo."""

STEADY = Recipe(
    "steady",
    Task(
        actuation=HAND,
        rewarded=RewardSettings(weights=Weights(cube_speed=-1.0), rotation_cap_rad_s=1.5),
    ),
    survival_goal=0.98,
)
"""For the hand: servo in the loop, no reward for racing, a price on throwing the cube about."""

RECIPES = {recipe.name: recipe for recipe in (STEADY, FAST)}


def on_gpu(recipe: Recipe) -> Recipe:
    """Return the recipe at the paper's scale: 8192 environments, 32 minibatches, 3e8 steps."""
    return replace(
        recipe,
        environments=8192,
        minibatches=32,
        steps=300_000_000,
        checkpoint_steps=5_242_880,
        stuck=replace(recipe.stuck, steps=30_000_000),
    )
