"""Measurement of a policy in simulation: plain MuJoCo as trained, behind servos, and built hands of the training."""

from collections.abc import Callable
from dataclasses import replace

from aero.policy.file import Policy
from aero.policy.settings import PAPER_DEPLOYMENT, PolicySettings
from simulator.scene import CUBE, Cube
from train.actuation import BUS, ActuationRanges
from train.evaluation.rollouts import Episodes, run, task_of
from train.hand_stock import HandStock
from train.recipe import TrainingStage
from train.simulator import Simulator, build_scene
from train.task import NOMINAL_RESET, Task

SERVO_LAG_S = 0.025
"""Closed-loop lag of the physical hand's servos, s; the lag of the delay sweep."""
SERVO_DELAY_S = 0.025
"""Delay from a command to motion and the next reading, rounded up, s; the delay of the lag sweep."""
SWEEP_LAGS_S = (0.015, 0.040, 0.060)
SWEEP_DELAYS_S = (0.0, 0.010, 0.020, 0.030, 0.040, 0.050)
BUILT = "built hands, as training draws them"
BUILT_STAGE = TrainingStage("built", steps=0, built=True, actuation=BUS)

Figures = dict[str, dict[str, float]]
"""Figures in SI units by condition and name."""


def conditions(policy: Policy) -> dict[str, Task]:
    """Return the conditions in plain MuJoCo by name; servos with lag and delay come last."""
    as_trained, deployed = task_of(policy), task_of(policy, PAPER_DEPLOYMENT)
    servos = [(SERVO_LAG_S, delay_s) for delay_s in SWEEP_DELAYS_S] + [(lag, SERVO_DELAY_S) for lag in SWEEP_LAGS_S]
    return {
        "as trained, with noise": as_trained,
        "as trained, no noise": replace(as_trained, settings=replace(policy.settings, noise=(0.0,) * 7)),
        "as trained, a period late": replace(as_trained, actuation=_servo(0.0, policy.settings.period_s)),
        "deployed, nominal grasp": replace(deployed, reset=NOMINAL_RESET),
        **{_name(*servo): replace(as_trained, actuation=_servo(*servo)) for servo in servos},
    }


def measure(
    policy: Policy, episodes: int, *, seconds: float, seed: int, progress: Callable[[float, str], None]
) -> Figures:
    """Measure under every condition and on built hands with the paper's cube."""
    cases, found = conditions(policy), {}
    with Simulator([build_scene(policy.settings.torque_limit).compile()] * episodes) as batch:
        for done, (name, task) in enumerate(cases.items()):
            progress(done / (len(cases) + 1), name)
            found[name] = run(policy, task, batch, seconds, seed)
    progress(len(cases) / (len(cases) + 1), BUILT)
    with HandStock(BUILT_STAGE, policy.settings, (seed,), training=False).batch(range(episodes)) as batch:
        found[BUILT] = run(policy, replace(task_of(policy), actuation=BUILT_STAGE.actuation), batch, seconds, seed)
    return {name: one.summary() for name, one in found.items()}


def beside_a_deployment(
    policy: Policy, settings: PolicySettings, episodes: int, *, seconds: float, seed: int, cube: Cube = CUBE
) -> dict[str, Episodes]:
    """Measure as trained and with a deployment's `settings`, both with random resets and the training's noise.

    Without noise, all episodes from the nominal grasp would be identical.
    """
    tasks = {
        "plain MuJoCo, as trained": task_of(policy),
        "plain MuJoCo, settings of the deployment": task_of(policy, replace(settings, noise=policy.settings.noise)),
    }
    with Simulator([build_scene(policy.settings.torque_limit, cube).compile()] * episodes) as batch:
        return {name: run(policy, task, batch, seconds, seed) for name, task in tasks.items()}


def _servo(lag_s: float, delay_s: float) -> ActuationRanges:
    return ActuationRanges(lag_s=(lag_s, lag_s), delay_s=(delay_s, delay_s))


def _name(lag_s: float, delay_s: float) -> str:
    return f"lag {lag_s * 1e3:.0f}, delay {delay_s * 1e3:.0f} ms"
