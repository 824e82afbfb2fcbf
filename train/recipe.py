"""Recipes: everything that decides what a training run becomes, except its seed."""

from __future__ import annotations

from dataclasses import dataclass, replace
from hashlib import sha256

from aero.policy.settings import PAPER_TRAINING
from train.actuation import BUS, IDEAL, SERVOS, ActuationRanges
from train.hands import HANDS, HandRanges
from train.randomise import PAPER_TIP_FRICTION, SERVO_ROWS, Row
from train.task.episode import Task
from train.task.reward import PAPER_REWARD, RewardSettings, Weights, side_by_side


@dataclass(frozen=True)
class Stage:
    """A stretch of a run with one reward and one set of PPO's settings; the defaults are the paper's."""

    steps: int
    """Environment steps."""
    rewarded: RewardSettings = PAPER_REWARD
    """What is rewarded."""
    routed_rewarded: RewardSettings | None = None
    """What is rewarded on the routed hands, if something else than on the built ones."""
    actuation: ActuationRanges = IDEAL
    """What the hand does to commands and readings."""
    rows: tuple[Row, ...] = ()
    """What is randomised besides the paper's table, on routed hands."""
    built: float = 0.0
    """Share of built hands among the environments."""
    hands: HandRanges = HANDS
    """Which built hands."""
    any_cube: bool = False
    """Whether every hand has a cube of its own (`model.cubes`), for training and measuring, or the paper's."""
    learning_rate: float = 3e-4
    """Adam's."""
    discount: float = 0.97
    """A control step."""
    entropy_cost: float = 1e-2
    """Weight of the policy's entropy."""
    episode_steps: int = 500
    """Control steps after which an episode is cut off and another start is drawn."""
    routed_measured: ActuationRanges | None = None
    """What measured routed hands do to commands and readings, if something else than those it trains on."""
    measured: int = 100
    """Hands that a checkpoint is measured on, one episode each; those of the last stage decide which one is kept."""

    def __post_init__(self) -> None:
        if not 0.0 <= self.built < 1.0:
            raise ValueError(f"some hands of a stage must be routed: 0 <= built < 1, got {self.built}")

    def built_hands(self, hands: int) -> int:
        """Return how many of a batch of `hands` are built; they are the last."""
        return int(self.built * hands)

    def rewards(self, hands: int) -> RewardSettings:
        """Return what is rewarded in each of a batch of `hands`."""
        if self.routed_rewarded is None:
            return self.rewarded
        return side_by_side(self.routed_rewarded, hands - self.built_hands(hands), self.rewarded, hands)


@dataclass(frozen=True)
class Stuck:
    """When a run is given up and begun again with another seed: some settle into holding the cube still."""

    steps: int = 2_000_000
    """Environment steps that a run may take to get going."""
    rate_rad_s: float = 0.15
    """Rotation that the best checkpoint must have reached by then."""


@dataclass(frozen=True)
class Goal:
    """What a checkpoint should reach before its rate alone counts; the prices of falling short are in rad/s."""

    survival: float = 0.95
    """Share of episodes that keep the cube, on the routed hands."""
    built_survival: float = 0.9
    """The same on the built hands, which are drawn wider than hands are."""
    airborne: float = 1.0
    """Share of the physics steps in which nothing touches the cube, on the routed hands."""
    survival_price: float = 5.0
    """Of the whole share."""
    airborne_price: float = 50.0
    """Of the whole share."""

    def score(self, rate_rad_s: float, *, survival: float, built_survival: float, airborne: float) -> float:
        """Return what checkpoints are chosen by: the rate, less what falling short costs."""
        lost = max(0.0, self.survival - survival) + max(0.0, self.built_survival - built_survival)
        return rate_rad_s - self.survival_price * lost - self.airborne_price * max(0.0, airborne - self.airborne)


@dataclass(frozen=True)
class Recipe:
    """One way to train a policy with Brax PPO; the PPO defaults are the paper's."""

    name: str
    """Name of the policy it makes."""
    task: Task
    """What is trained for; the stages say what is rewarded, and on which hands."""
    stages: tuple[Stage, ...]
    """One after another; each goes on with the networks of the one before, and looks for its own best checkpoint."""
    tip_friction: tuple[float, float] = PAPER_TIP_FRICTION
    """Range of the routed hands' fingertip friction in training."""
    goal: Goal = Goal()
    """What checkpoints are chosen by."""
    environments: int = 256
    """Parallel environments."""
    minibatches: int = 4
    """Minibatches a batch; together they hold one unroll of every environment."""
    unroll: int = 40
    """Control steps an unroll."""
    epochs: int = 4
    """Passes over a batch."""
    checkpoint_steps: int = 204_800
    """Environment steps between checkpoints."""
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

    def task_in(self, stage: Stage, hands: int) -> Task:
        """Return what is trained for in one of the stages, on a batch of `hands`."""
        return replace(
            self.task, rewarded=stage.rewards(hands), actuation=stage.actuation, episode_steps=stage.episode_steps
        )

    @property
    def fingerprint(self) -> str:
        """SHA-256 of everything in it, so that a policy tells which recipe made it."""
        return sha256(repr(self).encode()).hexdigest()

    @property
    def steps(self) -> int:
        """Environment steps of the whole run."""
        return sum(stage.steps for stage in self.stages)

    def with_steps(self, steps: int) -> Recipe:
        """Return the recipe for a run of `steps`, with at least ten checkpoints where the batches allow."""
        batch = self.environments * self.unroll
        stages = tuple(replace(stage, steps=round(stage.steps * steps / self.steps)) for stage in self.stages)
        return replace(self, stages=stages, checkpoint_steps=max(batch, min(self.checkpoint_steps, steps // 10)))


PAPER = Recipe("paper", Task(), (Stage(10_000_000),))
"""The paper's task, reward and settings, nothing added."""

TIP_FRICTION = (0.2, 1.0)
"""From the model's own, which both emulated hands have too, to the paper's upper end."""

BOLD = RewardSettings(Weights(action_rate=-0.2))
"""For the beginning: at the paper's price exploring costs more than a gait earns, and many runs hold the cube still."""

BOLDEST = RewardSettings(Weights(action_rate=-0.1))
"""For the beginning on built hands."""

SMOOTH = RewardSettings(Weights(action_rate=-0.3))
"""For the middle: a gait that is found can pay more than one that is looked for."""

SURE = RewardSettings(Weights(fall=-200.0, action_rate=-0.3, airborne=-10.0, pushed=-5.0))
"""For the end on built hands: twice the paper's price on losing the cube, one on bouncing, and one on a thumb that
gives way, which the guard ends."""

GENTLE = RewardSettings(
    Weights(fall=-200.0, action_rate=-0.3, airborne=-50.0, cube_speed=-10.0), rotation_cap_rad_s=1.0, affordable=0.5
)
"""For the end on routed hands, where gaits that throw the cube are easily found: bouncing and the cube's speed take up
to half of what turning earns, and bursts earn nothing."""


HALF_TORQUE = replace(PAPER_TRAINING, noise=(0.002, 0.002, 0.002, 0.002, 0.02, 0.002, 0.002), torque_limit=0.5)
"""The paper's training settings with half the servos' torque, and 2 mm of noise for 5, still 145 encoder counts."""

FAST = Recipe(
    "fast",
    Task(
        settings=replace(
            HALF_TORQUE,
            nominal=(0.086,) * 4 + PAPER_TRAINING.nominal[4:],
            scale=(0.024,) * 4 + PAPER_TRAINING.scale[4:],
        )
    ),
    (
        Stage(1_000_000, BOLD, actuation=SERVOS, rows=SERVO_ROWS),
        Stage(5_000_000, RewardSettings(Weights(fall=-150.0, action_rate=-0.3))),
    ),
    tip_friction=TIP_FRICTION,
    goal=Goal(survival=0.97),
    stuck=Stuck(steps=800_000),
)
"""For the record in simulation, with the fingers' whole range: the gait is found behind servos, where it is found soon,
and raced without them."""


NEAR_DEFAULT = replace(HANDS, towards_recorded=(0.0, 0.5))
"""For the beginning: a gait is found sooner where the springs are alike."""

LESS_CORRECTED = replace(HANDS, correction_error_m=2 * HANDS.correction_error_m)
"""For the end: a gait must not lean on a correction that nobody has."""


STEADY = Recipe(
    "steady",
    Task(settings=HALF_TORQUE),
    (
        Stage(1_000_000, BOLDEST, actuation=BUS, rows=SERVO_ROWS, built=0.75, hands=NEAR_DEFAULT, measured=50),
        Stage(2_800_000, SMOOTH, actuation=BUS, rows=SERVO_ROWS, built=0.9, any_cube=True, measured=50),
        Stage(
            1_200_000,
            SURE,
            routed_rewarded=GENTLE,
            # Commands without delay and in steps of any size too, as in the ideal simulator.
            actuation=replace(BUS, delay_s=(0.0, BUS.delay_s[1]), slewed=False),
            routed_measured=IDEAL,
            built=0.6,
            hands=LESS_CORRECTED,
            any_cube=True,
            entropy_cost=1e-3,
            episode_steps=200,  # short ones have many starts, in which most cubes are lost
            measured=100,
        ),
    ),
    tip_friction=TIP_FRICTION,
    goal=Goal(survival=0.98, built_survival=0.95, airborne=0.01),
    stuck=Stuck(steps=1_000_000, rate_rad_s=0.4),
)
"""For the hand, in three stages (docs/recipes.md): the gait is found where it is easy, with the paper's cube on built
hands of like springs; it is led to all springs and all cubes; and it settles, exploring little, on the paper's hands
too, where it learns not to throw the cube."""

RECIPES = {recipe.name: recipe for recipe in (STEADY, FAST, PAPER)}


def on_routed_hands(recipe: Recipe) -> Recipe:
    """Return the recipe for MJX, which steps no built hands: routed ones behind servos take their place."""
    stages = tuple(
        replace(
            stage,
            built=0.0,
            rewarded=stage.routed_rewarded or stage.rewarded,
            routed_rewarded=None,
            actuation=SERVOS if stage.built else stage.actuation,
        )
        for stage in recipe.stages
    )
    return replace(recipe, stages=stages)


def on_gpu(recipe: Recipe) -> Recipe:
    """Return the recipe at the paper's scale: 8192 environments, 32 minibatches, 3e8 steps; routed hands only."""
    large = replace(on_routed_hands(recipe), environments=8192, minibatches=32, stuck=Stuck(steps=30_000_000))
    return replace(large.with_steps(300_000_000), checkpoint_steps=5_242_880)
