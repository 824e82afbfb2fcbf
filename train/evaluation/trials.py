"""Trials through every byte: which are made, and running them on all cores."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from math import isnan, nan
from multiprocessing import cpu_count, get_context
from pathlib import Path

import numpy as np

from aero.channels import CABLES, Channel
from aero.firmware import DEFAULT_FIRMWARE
from aero.policy.file import Policy
from aero.policy.running import Ending, RunSettings
from model.geometry import Side
from model.scene import any_cube
from model.units import Unit, load_unit
from model.units.cable_correction import NONE as UNCORRECTED
from model.units.cable_correction import TYPICAL, correction, named_correction
from model.units.plausible import plausible_unit
from train.evaluation.cube_trial import AS_MEASURED, CubeTrial, Surroundings, run_trial
from train.evaluation.trial_set import share_interval, trial_set_of
from train.workers import leave_interrupts_to_the_parent

ANY_CUBE = "any cube on any hand"
CUBE_STREAM, WRONG_STREAM = 2, 3
"""Streams of a trial's seed that its cube and the error of its correction are drawn from."""
SIDES: tuple[Side, ...] = ("right", "left")
EXACT, WRONG = "exact", "wrong"
CORRECTIONS = (TYPICAL, EXACT, UNCORRECTED, WRONG)
WRONG_M = 0.0005
"""Standard deviation of the correction of a cable that is wrong, m."""
HELD_AFTER_S = (15.0, 50.0, 200.0)
"""After which it is said how many of longer trials still hold the cube: 50 s is the paper's rollout."""


@dataclass(frozen=True)
class Case:
    """One trial to be made."""

    name: str
    """Row of the table that it counts for."""
    unit: Unit
    firmware: str
    seed: int
    settings: RunSettings
    surroundings: Surroundings = AS_MEASURED


def over_hands(
    policy: Policy,
    hands: int,
    *,
    seconds: float,
    seed: int,
    correct: str = TYPICAL,
    twins: Path | None = None,
) -> list[Case]:
    """Return a trial of any cube on each of `hands` fresh hands, right and left in turn.

    Args:
        policy: what acts.
        hands: how many.
        seconds: length of a trial.
        seed: of the first hand; each has the next one, which decides its cube, too.
        correct: how the cables are corrected for, one of `CORRECTIONS`: as healthy hands need it on average, as this
            one does, not at all, or each with an error of `WRONG_M`.
        twins: folder of unit files that were fitted to recordings of these hands (`aero-hil calibrate`), named
            `SEED.toml`; they replace `correct`, and hands without one are left out.

    Raises:
        ValueError: `twins` has none of these hands.
    """
    made = []
    for k in range(hands):
        number = seed + k
        unit, cube = plausible_unit(number), any_cube(np.random.default_rng((number, CUBE_STREAM)))
        twin = None if twins is None else twins / f"{number}.toml"
        if twin is not None and not twin.exists():
            continue
        if twin is not None:
            row = correction(load_unit(str(twin)), policy.settings)
        elif correct in (TYPICAL, UNCORRECTED):
            row = named_correction(correct, policy.settings)
        else:
            row = correction(unit, policy.settings)
        if correct == WRONG and twin is None:
            error = np.random.default_rng((number, WRONG_STREAM)).standard_normal(len(Channel))
            row = row + WRONG_M * error * np.isin(np.arange(len(Channel)), CABLES)
        settings = RunSettings(seconds=seconds, correction=tuple(row.tolist()))
        surroundings = Surroundings(cube, SIDES[k % len(SIDES)])
        made.append(Case(ANY_CUBE, unit, DEFAULT_FIRMWARE, number, settings, surroundings))
    if not made:
        raise ValueError(f"{twins} has no {seed}.toml, nor the unit file of another hand of this evaluation")
    return made


def run_trials(
    policy: Policy, cases: Sequence[Case], made: dict[str, list[CubeTrial]], progress: Callable[[float, str], None]
) -> None:
    """Run the trials on all cores; each is in `made`, by the name of its case, as soon as it has ended.

    However this is left, no worker is.
    """
    workers = min(cpu_count(), max(len(cases), 1))
    # A fresh interpreter a worker: a copy of this one would share its threads' locks. Leaving the pool ends them.
    with get_context("spawn").Pool(workers, initializer=leave_interrupts_to_the_parent) as pool:
        for done, (case, trial) in enumerate(zip(cases, pool.imap(partial(_trial, policy), cases), strict=True), 1):
            made.setdefault(case.name, []).append(trial)
            progress(done / len(cases), case.name)


def figures(trials: Sequence[CubeTrial]) -> dict[str, float]:
    """Return the figures of a row of trials, SI units."""
    found = trial_set_of("", trials)
    longest_s = max(one.alive_s for one in trials)
    held: dict[str, float] = {}
    for moment in (moment for moment in HELD_AFTER_S if moment < longest_s - 1.0):
        count, name = sum(one.kept or one.alive_s > moment for one in trials), f"held_{moment:g}_s"
        low, high = share_interval(count, len(trials))
        held |= {name: count / len(trials), f"{name}_low": low, f"{name}_high": high}
    return {
        "episodes": float(found.trials),
        "survival": found.kept_share,
        "survival_low": found.kept_interval[0],
        "survival_high": found.kept_interval[1],
        "rate_rad_s": found.rate_rad_s,
        "rate_rad_s_low": found.rate_interval[0],
        "rate_rad_s_high": found.rate_interval[1],
        "rotation_median_rad": found.turned_rad,
        "turned_share": found.turning,
        "let_go": _mean([one.let_go for one in trials]),
        "airborne": _mean([one.airborne for one in trials]),
        "finger_travel_m_s": _mean([value for one in trials for value in one.travel_per_s[:4]]),
        "stopped": _mean([one.run.ending is not Ending.TIME for one in trials]),
        "mean_current_a": float(np.max(np.mean([one.mean_currents_a for one in trials], axis=0))),
        "peak_current_a": max(one.run.peak_current_a for one in trials),
        **held,
    }


def _mean(values: Sequence[float]) -> float:
    return float(np.mean([value for value in values if not isnan(value)] or nan))


def _trial(policy: Policy, case: Case) -> CubeTrial:
    return run_trial(
        policy,
        case.unit,
        firmware=case.firmware,
        seed=case.seed,
        settings=case.settings,
        surroundings=case.surroundings,
    )
