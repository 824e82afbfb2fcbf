"""Trials on emulated hands with board and bus: their cases, execution on all cores, and summary figures."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from importlib.resources import files
from math import nan
from typing import Any

import numpy as np
from scipy.stats import bootstrap

from aero.channels import CABLES, Channel
from aero.floats import Floats
from aero.policy.cables import MEASURED
from aero.policy.file import Policy
from aero.policy.running import Ending, RunSettings
from aero.policy.settings import PRESETS
from aero.policy.task import ShownAction
from aero.side import Side
from aero_hil_toml import filled, parsed
from hil.emulated.emulated_spec import EmulatedSpec
from model.units.cable_correction import NONE, TYPICAL, correction, named_correction
from model.units.conditions import Conditions
from model.units.plausible import PLAUSIBLE, unit_named
from simulator.scene import CUBE, Cube, any_cube
from train.cable_measurement import wrong_cables
from train.evaluation.cube_trial import CubeTrial, run_trial
from train.share import CONFIDENCE, Share
from train.task import HARDLY_RAD_S
from train.workers import usable_cores, worker_processes

ANY_CUBE = "any cube on any hand"
CUBE_STREAM, WRONG_STREAM = 2, 3
"""Random streams of a trial's seed for the cube and for the error of the correction."""
SIDES: tuple[Side, ...] = ("right", "left")
EXACT, WRONG = "exact", "wrong"
CORRECTIONS = (MEASURED, TYPICAL, EXACT, NONE, WRONG)
WRONG_M = 0.0005
"""Standard deviation of a wrong cable correction, m."""
HELD_AFTER_S = (15.0, 50.0, 200.0)
"""Times, s, at which longer trials report the share that still holds the cube; 50 s is the paper's rollout."""
LEAST = 3
"""Smallest number of trials with an interval of the mean."""
OWN = "own"
"""Placeholder for the value that the policy was trained with."""
ANY_HAND = PLAUSIBLE.removesuffix(":")
"""Placeholder for another hand of the healthy population in each trial."""


@dataclass(frozen=True)
class Case:
    """One planned trial."""

    name: str
    """Name of the table row that counts this trial."""
    spec: EmulatedSpec
    settings: RunSettings
    measured: bool = False
    """True to measure the correction at the start of the trial."""


def over_hands(
    policy: Policy,
    hands: int,
    *,
    seconds: float,
    seed: int,
    correct: str = MEASURED,
    cables_m: float = 0.0,
) -> list[Case]:
    """Return a trial of a random cube on each of `hands` fresh hands, right and left in turn.

    Args:
        policy: the policy to run.
        hands: number of hands.
        seconds: length of a trial, s.
        seed: seed of the first hand and its cube; the others follow by one each.
        correct: cable correction, one of `CORRECTIONS`: measured at the start, typical, the hand's own, none, or the
            hand's own with an error of `WRONG_M` per cable.
        cables_m: half width of a uniform error of each cable's length, m.
    """
    made = []
    for k in range(hands):
        number = seed + k
        unit, cube = f"{PLAUSIBLE}{number}", any_cube(np.random.default_rng((number, CUBE_STREAM)))
        conditions = wrong_cables(number, cables_m) if cables_m else None
        measured = correct == MEASURED
        if correct in (EXACT, WRONG):
            row = correction((conditions or Conditions()).applied(unit_named(unit)), policy.settings)
        else:
            row = named_correction(TYPICAL if measured else correct, policy.settings)
        if correct == WRONG:
            error = np.random.default_rng((number, WRONG_STREAM)).standard_normal(len(Channel))
            row = row + WRONG_M * error * np.isin(np.arange(len(Channel)), CABLES)
        side = SIDES[k % len(SIDES)]
        spec = EmulatedSpec(unit=unit, seed=number, side=side, guarded=True, cube=cube, conditions=conditions)
        made.append(Case(ANY_CUBE, spec, RunSettings(seconds=seconds, correction=tuple(row.tolist())), measured))
    return made


@dataclass(frozen=True)
class Deployment:
    """Named conditions to run any policy under: a row of `deployments.toml`."""

    name: str
    meaning: str
    unit: str
    """Unit name for `unit_named`, or `ANY_HAND`."""
    firmware: str
    settings: str
    """Preset of `aero.policy.settings`, or `OWN`."""
    one_period_late: bool
    shown_action: str
    """A value of `ShownAction`, or `OWN`."""
    correction: str
    """Cable correction: `measured`, `typical`, `none`, or `EXACT` for the hand's own."""
    guarded: bool
    reference: str = ""
    """Result of a physical hand under these conditions, with the policy's name."""
    measured_rad_s: float | None = None
    """Rotation rate of the physical hand in `reference`, rad/s."""

    def run_settings(self, seconds: float) -> RunSettings:
        """Return the settings of the control loop, without the correction."""
        return RunSettings(
            seconds=seconds,
            settings=None if self.settings == OWN else PRESETS[self.settings],
            one_period_late=self.one_period_late,
            shown_action=None if self.shown_action == OWN else ShownAction(self.shown_action),
        )

    def cases(self, policy: Policy, trials: int, *, seconds: float, seed: int, cube: Cube = CUBE) -> list[Case]:
        """Return trials of emulated hands with `cube` under these conditions, with seeds counted up from `seed`.

        Raises:
            ValueError: there is no such unit.
        """
        settings, found = self.run_settings(seconds), []
        for number in range(seed, seed + trials):
            unit = f"{PLAUSIBLE}{number}" if self.unit == ANY_HAND else self.unit
            measured = self.correction == MEASURED
            whose = unit if self.correction == EXACT else TYPICAL if measured else self.correction
            row = named_correction(whose, settings.settings or policy.settings)
            spec = EmulatedSpec(unit=unit, firmware=self.firmware, seed=number, guarded=self.guarded, cube=cube)
            found.append(Case(self.name, spec, replace(settings, correction=tuple(row.tolist())), measured))
        return found


@cache
def load_deployments() -> dict[str, Deployment]:
    """Return the deployments of `deployments.toml` by name."""
    text = (files("train") / "evaluation" / "deployments.toml").read_text(encoding="utf-8")
    rows = parsed(text, "deployments.toml").items()
    return {name: filled(Deployment, row | {"name": name}, f"deployments.toml, [{name}]") for name, row in rows}


def run_trials(
    policy: Policy, cases: Sequence[Case], made: dict[str, list[CubeTrial]], progress: Callable[[float, str], None]
) -> None:
    """Run the trials on all cores; append each result to `made[case.name]` when its trial ends."""
    with worker_processes(min(usable_cores(), max(len(cases), 1))) as workers:
        trials = workers.map(partial(_trial, policy), cases)
        for done, (case, trial) in enumerate(zip(cases, trials, strict=True), 1):
            made.setdefault(case.name, []).append(trial)
            progress(done / len(cases), case.name)


def _trial(policy: Policy, case: Case) -> CubeTrial:
    return run_trial(policy, case.spec, case.settings, measured=case.measured)


def figures(trials: Sequence[CubeTrial]) -> dict[str, float]:
    """Return the summary figures of trials, SI units; shares and rates with 95 % intervals."""
    alive, rotation = np.array([(one.alive_s, one.rotation_rad) for one in trials]).T
    low, high = _rate_interval(trials)
    held: dict[str, float] = {}
    for moment in (moment for moment in HELD_AFTER_S if moment < max(alive) - 1.0):
        held |= _share(f"held_{moment:g}_s", [one.kept or one.alive_s > moment for one in trials])
    return {
        "episodes": float(len(trials)),
        **_share("survival", [one.kept for one in trials]),
        "wedged": _mean([one.wedged for one in trials]),
        "rate_rad_s": float(_rate(rotation, alive)),
        "rate_rad_s_low": low,
        "rate_rad_s_high": high,
        "rotation_median_rad": float(np.median(rotation)),
        "turned_share": _mean([one.rate_rad_s > HARDLY_RAD_S for one in trials]),
        "let_go": _mean([one.let_go for one in trials]),
        "airborne": _mean([one.airborne for one in trials]),
        "finger_travel_m_s": _mean([value for one in trials for value in one.travel_per_s[:4]]),
        "stopped": _mean([one.run.ending is not Ending.TIME for one in trials]),
        "mean_current_a": float(np.max(np.mean([one.mean_currents_a for one in trials], axis=0))),
        "peak_current_a": max(one.run.peak_current_a for one in trials),
        **held,
    }


def _rate_interval(trials: Sequence[CubeTrial]) -> tuple[float, float]:
    """Return the bootstrapped interval of the total rate; NaN for fewer than `LEAST` trials."""
    each = [one.rate_rad_s for one in trials]
    if len(each) < LEAST:
        return (nan, nan)
    if np.ptp(each) == 0.0:
        return (float(each[0]), float(each[0]))
    columns = [one.rotation_rad for one in trials], [one.alive_s for one in trials]
    found = bootstrap(columns, _rate, confidence_level=CONFIDENCE, paired=True, rng=0)
    return (float(found.confidence_interval.low), float(found.confidence_interval.high))


def _rate(rotation: Floats, alive: Floats, axis: int = -1) -> Any:
    """Return the total rotation over the total time, which gives early drops little weight."""
    return rotation.sum(axis) / np.maximum(alive.sum(axis), np.finfo(float).tiny)


def _share(name: str, each: Sequence[bool]) -> dict[str, float]:
    share = Share(sum(each), len(each))
    low, high = share.interval
    return {name: share.value, f"{name}_low": low, f"{name}_high": high}


def _mean(values: Sequence[float]) -> float:
    finite = [value for value in values if np.isfinite(value)]
    return float(np.mean(finite or nan))
