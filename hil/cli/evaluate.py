"""`aero-hil evaluate`: will this policy survive the hand?"""

from __future__ import annotations

import json
import sys
from concurrent.futures import ProcessPoolExecutor as Pool
from dataclasses import asdict, replace
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import NamedTuple

import click
import numpy as np
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from aero.policy.file import Policy, PolicyFileError
from aero.policy.limits import Ending
from aero.policy.running import RunSettings, Step
from aero.policy.shipped import DEFAULT, find_policy
from aero.policy.task import CHANNELS
from firmware_emulator.firmware.profiles import PROFILES
from hil.policies.cube_trial import Trial, run_trial
from hil.policies.transmission_gap import ChannelGap, attribute
from hil.targets.target import DEFAULT_FIRMWARE
from model.units import Unit, load_unit
from model.units.cable_correction import correction
from model.units.plausible import plausible_unit
from train.actuation import BUS
from train.built import BuiltSimulator, draw_scenes
from train.evaluation.conditions import conditions, delay_sweep, lag_sweep, measure
from train.evaluation.figures import delay_picture, video
from train.evaluation.rollouts import log, run, task_of
from train.hands import HANDS, corrections, draw_hand
from train.scene import build_scene
from train.simulator import Batch, Simulator
from train.task.grasp import NOMINAL_RESET

BACKENDS = ("mujoco", "mjx", "built", "bytes")
COLUMNS = {
    "survival": ("keeps", "{:.2f}"),
    "rate_rad_s": ("rad/s", "{:.2f}"),
    "rotation_median_rad": ("rad", "{:.1f}"),
    "airborne": ("no contact", "{:.2%}"),
    "action_change": ("change", "{:.2f}"),
    "finger_travel_m_s": ("mm/s", "{:.1f}"),
    "stopped": ("stopped", "{:.2f}"),
    "mean_current_a": ("mean A", "{:.2f}"),
    "peak_current_a": ("peak A", "{:.2f}"),
}
"""Heading and format of each figure: share that keeps the cube, mean rate, median rotation, steps without contact,
change of the action from step to step, commanded travel of a finger, share of trials that a limit ended, motor current
of the channel that draws most, mean and peak."""

WIDTH = 120
"""Columns where no terminal says how many there are: for a name and the figures beside it."""


@click.command()
@click.argument("policy_name", metavar="[POLICY]", default=DEFAULT)
@click.option(
    "--on", "backends", type=click.Choice(BACKENDS), multiple=True, default=("mujoco", "built", "bytes"),
    show_default=True,
    help="What to run on: plain MuJoCo, MJX, built hands in process, emulated hands through every byte. Repeatable.",
)  # fmt: skip
@click.option("--episodes", type=int, default=100, show_default=True, help="Episodes of each condition in simulation.")
@click.option("--trials", type=int, default=10, show_default=True, help="Trials of each hand through the bytes.")
@click.option("--units", type=int, default=5, show_default=True, help="Random hands that share one set of trials.")
@click.option("--seconds", type=float, default=15.0, show_default=True, help="Length of an episode.")
@click.option("--seed", type=int, default=0, show_default=True, help="Seed of everything that is drawn.")
@click.option("--video", "with_video", is_flag=True, help="Render one episode.")
@click.option(
    "--out", type=click.Path(file_okay=False, path_type=Path), default=Path("evaluation"), show_default=True,
    help="Folder for evaluation.json, delay.png and policy.mp4.",
)  # fmt: skip
def evaluate(
    *,
    policy_name: str,
    backends: tuple[str, ...],
    episodes: int,
    trials: int,
    units: int,
    seconds: float,
    seed: int,
    with_video: bool,
    out: Path,
) -> None:
    """Measure POLICY, a shipped one (`steady`, the default, or `fast`) or a file: rotation, rate, survival and more.

    In simulation under its training conditions, a control period late, in the paper's deployment settings and behind a
    servo with a sweep of delays and lags; through the bytes on each shipped unit, on random ones and on each firmware.
    """
    console = Console(width=None if sys.stdout.isatty() else WIDTH)
    try:
        policy = find_policy(policy_name)
    except PolicyFileError as error:
        raise click.UsageError(str(error)) from error
    out.mkdir(parents=True, exist_ok=True)
    results: dict[str, dict[str, dict[str, float]]] = {}
    if "mujoco" in backends:
        with Simulator([build_scene(policy.settings.torque_limit).compile()] * episodes) as batch:
            results["plain MuJoCo"] = _simulated(
                console, policy, batch, seconds=seconds, seed=seed, picture=out / "delay.png"
            )
    if "mjx" in backends:
        results["MJX"] = _over_mjx(policy, episodes, seconds, seed)
    if "built" in backends:
        results["built hands in process"] = _on_built(policy, episodes, seconds, seed)
    if "bytes" in backends:
        results["every byte"] = _through_bytes(
            console, _cases(policy, trials, units, seconds=seconds, seed=seed), policy
        )
    gaps = _gaps(policy, seconds, seed) if "bytes" in backends else ()
    report = {"policy": policy.name, "results": results, "open_loop": [_as_json(gap) for gap in gaps]}
    (out / "evaluation.json").write_text(json.dumps(report, indent=1))
    for backend, rows in results.items():
        _print(console, backend, rows)
    if gaps:
        _print_gaps(console, gaps)
    if with_video:
        video(log(policy, task_of(policy), seconds, seed).positions, out / "policy.mp4")


def _simulated(
    console: Console, policy: Policy, batch: Batch, *, seconds: float, seed: int, picture: Path
) -> dict[str, dict[str, float]]:
    swept = delay_sweep(policy)
    cases = [*conditions(policy), *(case for _, case in swept), *lag_sweep(policy)]
    with Progress(console=console, transient=True) as bar:
        task = bar.add_task("in simulation", total=len(cases))
        found = measure(
            policy, cases, batch, seconds=seconds, seed=seed,
            progress=lambda name: bar.update(task, advance=1, description=name),
        )  # fmt: skip
    delay_picture([delay for delay, _ in swept], [found[case.name] for _, case in swept], picture)
    return {name: one.summary() for name, one in found.items()}


def _over_mjx(policy: Policy, episodes: int, seconds: float, seed: int) -> dict[str, dict[str, float]]:
    try:
        from train.physics import MjxBatch  # noqa: PLC0415 - JAX is only needed here
    except ImportError as error:
        raise click.UsageError(f"--on mjx needs `pip install aero-hil[train]`: {error}") from error
    batch = MjxBatch([build_scene(policy.settings.torque_limit).compile()] * episodes)
    found = measure(policy, conditions(policy)[:1], batch, seconds=seconds, seed=seed)
    return {name: one.summary() for name, one in found.items()}


def _on_built(policy: Policy, episodes: int, seconds: float, seed: int) -> dict[str, dict[str, float]]:
    """Measure on built hands as training draws them, each episode on another."""
    rng = np.random.default_rng(seed)
    units = [draw_hand(HANDS, rng) for _ in range(episodes)]
    scenes = draw_scenes(units, HANDS, rng, policy.settings.torque_limit)
    corrected = corrections(units, policy.settings, rng, error_m=HANDS.correction_error_m)
    behind_the_bus = replace(task_of(policy), actuation=BUS)
    with BuiltSimulator(scenes, corrected) as batch:
        return {"as training draws them": run(policy, behind_the_bus, batch, seconds, seed).summary()}


class _Case(NamedTuple):
    """One trial to be made."""

    name: str
    unit: Unit
    firmware: str
    seed: int
    settings: RunSettings


def _cases(policy: Policy, trials: int, units: int, *, seconds: float, seed: int) -> list[_Case]:
    """Return every trial through the bytes; the random hands take turns in one set of trials."""
    reference, paper = load_unit("reference"), load_unit("paper")
    hands = [plausible_unit(seed + k) for k in range(units)]
    bare = RunSettings(seconds=seconds)
    corrected = {
        unit.name: replace(bare, correction=tuple(correction(unit, policy.settings)))
        for unit in (reference, paper, *hands)
    }
    turns = max(trials, units) if units else 0
    rows = [
        *((unit.name, [unit] * trials, DEFAULT_FIRMWARE, True) for unit in (reference, paper)),
        (f"random units ({units})", [hands[k % units] for k in range(turns)], DEFAULT_FIRMWARE, True),
        ("reference, not corrected", [reference] * trials, DEFAULT_FIRMWARE, False),
        (f"random units ({units}), not corrected", [hands[k % units] for k in range(turns)], DEFAULT_FIRMWARE, False),
        *(
            (f"reference, firmware {firmware}", [reference] * trials, firmware, True)
            for firmware in PROFILES
            if firmware != DEFAULT_FIRMWARE
        ),
        ("paper, firmware pre", [paper] * trials, "pre", True),
    ]
    return [
        _Case(name, unit, firmware, seed + k, corrected[unit.name] if known else bare)
        for name, turn, firmware, known in rows
        for k, unit in enumerate(turn)
    ]


def _through_bytes(console: Console, cases: list[_Case], policy: Policy) -> dict[str, dict[str, float]]:
    trials: dict[str, list[Trial]] = {}
    # A fresh interpreter a worker: a copy of this one would share its threads' locks.
    with Progress(console=console, transient=True) as bar, Pool(mp_context=get_context("spawn")) as pool:
        task = bar.add_task("through the bytes", total=len(cases))
        for case, trial in zip(cases, pool.map(partial(_trial, policy), cases), strict=True):
            trials.setdefault(case.name, []).append(trial)
            bar.update(task, advance=1, description=case.name)
    return {name: _summary(one) for name, one in trials.items()}


def _trial(policy: Policy, case: _Case) -> Trial:
    return run_trial(policy, case.unit, firmware=case.firmware, seed=case.seed, settings=case.settings)


def _gaps(policy: Policy, seconds: float, seed: int) -> tuple[ChannelGap, ...]:
    """Replay a simulated episode's actions on the reference hand, and run the policy on it too."""
    unit = load_unit("reference")
    settings = RunSettings(seconds=seconds, correction=tuple(correction(unit, policy.settings)))
    quiet = replace(policy.settings, noise=(0.0,) * CHANNELS)
    simulated = log(policy, replace(task_of(policy, quiet), reset=NOMINAL_RESET), seconds, seed)

    def lengths(script: np.ndarray | None) -> np.ndarray:
        steps: list[np.ndarray] = []

        def keep(step: Step) -> None:
            steps.append(step.lengths)

        run_trial(policy, unit, seed=seed, settings=settings, script=script, on_step=keep)
        return np.array(steps)

    after = lengths(simulated.actions)[1:]  # a reading shows what the action before it did
    return attribute(simulated.lengths[: len(after)], after, lengths(None))


def _as_json(gap: ChannelGap) -> dict[str, float | str]:
    return asdict(gap) | {"channel": gap.channel.label}


def _summary(trials: list[Trial]) -> dict[str, float]:
    return {
        "episodes": float(len(trials)),
        "survival": float(np.mean([one.kept for one in trials])),
        "rate_rad_s": float(np.mean([one.rate_rad_s for one in trials])),
        "rotation_median_rad": float(np.median([one.rotation_rad for one in trials])),
        "finger_travel_m_s": float(np.mean([one.travel_per_s[:4] for one in trials])),
        "stopped": float(np.mean([one.run.ending is not Ending.TIME for one in trials])),
        "mean_current_a": float(np.max(np.mean([one.mean_currents_a for one in trials], axis=0))),
        "peak_current_a": max(one.run.peak_current_a for one in trials),
    }


def _print(console: Console, backend: str, rows: dict[str, dict[str, float]]) -> None:
    shown = {key: column for key, column in COLUMNS.items() if any(key in row for row in rows.values())}
    table = Table(title=backend, title_justify="left")
    table.add_column("", no_wrap=True)
    for title, _ in shown.values():
        table.add_column(title, justify="right")
    scale = {"finger_travel_m_s": 1e3}
    for name, row in rows.items():
        table.add_row(name, *(form.format(row[key] * scale.get(key, 1.0)) for key, (_, form) in shown.items()))
    console.print(table)


def _print_gaps(console: Console, gaps: tuple[ChannelGap, ...]) -> None:
    table = Table(title="Motion with one episode's actions, mm or mrad (standard deviation)", title_justify="left")
    table.add_column("", no_wrap=True)
    for title in ("sim", "replayed", "rest", "offset", "closed loop"):
        table.add_column(title, justify="right")
    table.add_column("gap from", no_wrap=True)
    for gap in gaps:
        figures = (gap.simulated, gap.replayed, gap.residual, gap.offset, gap.closed_loop)
        table.add_row(gap.channel.label, *(f"{1e3 * figure:.2f}" for figure in figures), gap.cause)
    console.print(table)
