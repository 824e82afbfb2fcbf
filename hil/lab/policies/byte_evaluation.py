"""A policy measured through every byte: on shipped and random hands, on every firmware, corrected and not."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from math import isnan, nan
from multiprocessing import get_context

import numpy as np
from numpy.typing import NDArray

from aero.firmware import DEFAULT_FIRMWARE, firmware_of
from aero.policy.file import Policy
from aero.policy.limits import Ending
from aero.policy.running import RunSettings, Step
from firmware_emulator.firmware.profiles import PROFILES
from hil.lab.policies.cube_trial import AS_MEASURED, CubeTrial, Surroundings, run_trial
from hil.lab.policies.prediction import of_trials
from hil.lab.policies.survival import LONG_S
from hil.lab.policies.transmission_gap import ChannelGap, channel_gaps
from hil.lab.workers import leave_interrupts_to_the_parent
from hil.recordings.recorder import Progress
from model.cubes import PROPERTIES, any_cube
from model.scene import CUBE
from model.units import Unit, load_unit
from model.units.cable_correction import correction
from model.units.plausible import plausible_unit

Floats = NDArray[np.float64]

TURNS_RAD_S = 0.1
"""Rate from which a trial counts as one that turns the cube."""
BOOTSTRAP_SEED = 0
"""Seed of the bootstrapped intervals, so that the same trials give the same ones."""


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


def cases(policy: Policy, trials: int, units: int, *, seconds: float, seed: int) -> list[Case]:
    """Return every trial through the bytes; the `units` random hands take turns in one set of trials."""
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
            if firmware_of(firmware).moves_as != DEFAULT_FIRMWARE
        ),
        ("paper, firmware pre", [paper] * trials, "pre", True),
    ]
    return [
        Case(name, unit, firmware, seed + k, corrected[unit.name] if known else bare)
        for name, turn, firmware, known in rows
        for k, unit in enumerate(turn)
    ]


def over_cubes(policy: Policy, trials: int, *, seconds: float, seed: int) -> list[Case]:
    """Return every trial with another cube, each on another random hand that is corrected for.

    The hands are the same for every cube, so that cubes are compared and not hands.
    """
    rng = np.random.default_rng(seed)
    hands = [plausible_unit(seed + k) for k in range(trials)]
    settings = [RunSettings(seconds=seconds, correction=tuple(correction(unit, policy.settings))) for unit in hands]
    rows = [(one.label(value), [one.change(CUBE, value)] * trials) for one in PROPERTIES for value in one.values]
    rows.append(("any of these cubes", [any_cube(rng) for _ in range(trials)]))
    return [
        Case(name, hands[k], DEFAULT_FIRMWARE, seed + k, settings[k], Surroundings(cube))
        for name, cubes in rows
        for k, cube in enumerate(cubes)
    ]


def over_long(policy: Policy, trials: int, *, seed: int) -> list[Case]:
    """Return trials of `LONG_S` on the shipped hands and on another random hand each, all corrected for."""
    reference, paper = load_unit("reference"), load_unit("paper")
    rows = [
        ("reference", [reference] * trials),
        ("paper", [paper] * trials),
        ("random units", [plausible_unit(seed + k) for k in range(trials)]),
    ]
    units = {unit.name: unit for _, turn in rows for unit in turn}
    settings = {
        name: RunSettings(seconds=LONG_S, correction=tuple(correction(unit, policy.settings)))
        for name, unit in units.items()
    }
    return [
        Case(name, unit, DEFAULT_FIRMWARE, seed + k, settings[unit.name])
        for name, turn in rows
        for k, unit in enumerate(turn)
    ]


def run_trials(policy: Policy, made: list[Case], trials: dict[str, list[CubeTrial]], progress: Progress) -> None:
    """Run the trials on all cores; each is in `trials`, by the name of its case, as soon as it has ended.

    However this is left, no worker is.
    """
    # A fresh interpreter a worker: a copy of this one would share its threads' locks. Leaving the pool ends them.
    with get_context("spawn").Pool(initializer=leave_interrupts_to_the_parent) as pool:
        for done, (case, trial) in enumerate(zip(made, pool.imap(partial(_trial, policy), made), strict=True), 1):
            trials.setdefault(case.name, []).append(trial)
            progress(done / len(made), case.name)


def figures(trials: Mapping[str, list[CubeTrial]]) -> dict[str, dict[str, float]]:
    """Return the figures of each row of trials, SI units."""
    return {name: _summary(one) for name, one in trials.items()}


def open_loop_gaps(
    policy: Policy, actions: Floats, lengths: Floats, *, seconds: float, seed: int
) -> tuple[ChannelGap, ...]:
    """Replay a simulated episode's actions on the reference hand, and run the policy on it too.

    Args:
        policy: what acts.
        actions: of the simulated episode, (steps, 7).
        lengths: that the simulator reached, (steps, 7), m, abduction rad.
        seconds: length of the trials.
        seed: of the hand's noise and of where the cube is put.
    """
    unit = load_unit("reference")
    settings = RunSettings(seconds=seconds, correction=tuple(correction(unit, policy.settings)))

    def trial(script: Floats | None) -> Floats:
        steps: list[Floats] = []

        def keep(step: Step) -> None:
            steps.append(step.lengths)

        run_trial(policy, unit, seed=seed, settings=settings, script=script, on_step=keep)
        return np.array(steps)

    after = trial(actions)[1:]  # a reading shows what the action before it did
    return channel_gaps(lengths[: len(after)], after, trial(None))


def _trial(policy: Policy, case: Case) -> CubeTrial:
    return run_trial(
        policy,
        case.unit,
        firmware=case.firmware,
        seed=case.seed,
        settings=case.settings,
        surroundings=case.surroundings,
    )


def _summary(trials: list[CubeTrial]) -> dict[str, float]:
    said = of_trials("", trials, BOOTSTRAP_SEED)
    return {
        "episodes": float(len(trials)),
        "survival": said.kept / said.trials,
        "survival_low": said.kept_interval[0],
        "survival_high": said.kept_interval[1],
        "rate_rad_s": said.rate_rad_s,
        "rate_rad_s_low": said.rate_interval[0],
        "rate_rad_s_high": said.rate_interval[1],
        "rotation_median_rad": float(np.median([one.rotation_rad for one in trials])),
        "turned_share": float(np.mean([one.rate_rad_s > TURNS_RAD_S for one in trials])),
        "let_go": float(np.mean([one.let_go for one in trials if not isnan(one.let_go)] or nan)),
        "airborne": float(np.mean([one.airborne for one in trials if not isnan(one.airborne)] or nan)),
        "finger_travel_m_s": float(np.mean([one.travel_per_s[:4] for one in trials])),
        "stopped": float(np.mean([one.run.ending is not Ending.TIME for one in trials])),
        "mean_current_a": float(np.max(np.mean([one.mean_currents_a for one in trials], axis=0))),
        "peak_current_a": max(one.run.peak_current_a for one in trials),
    }
