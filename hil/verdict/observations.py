"""Observations on a channel's curves, shown beside the suspects without cause or judgement."""

from collections.abc import Iterator, Mapping
from contextlib import suppress

import numpy as np

from aero.channels import FINGERS, Channel
from aero.floats import Floats
from aero.protocol import MAX_CODE
from hil.checks.shared.experiment import map_of, require
from hil.checks.shared.signals import CommandStep, closing_current, find_steps, in_force
from hil.checks.staircase.cable_loads import loads
from hil.recordings.errors import CannotBeMeasuredError
from hil.recordings.recording import Recording

TAKE_UP, LEVELS = 2, 3
"""Number of levels of normal slack at the open end; number of levels that must clearly differ."""
NONE, LITTLE, HIGH, MUCH = 0.1, 0.15, 2.0, 2.8
"""Ratios of a current to the other fingers' median: clearly none, none, high, clearly high; good fingers have 0.35-2.4.
"""
TIMES, CYCLES, SMOOTH = range(2, 9), 1.25, 3
"""Harmonics per spool turn to fit, smallest number of cycles in the travel, degree of the smooth background."""
EXPLAINED, STRONG, STRONG_A = 0.8, 0.2, 0.1
"""Explained fraction of the residual, and amplitude relative to the median and in A; good cables reach 0.1."""
ROUGH_A = 0.2
"""Threshold of a curve's level-to-level bend, A; above it positions are not evaluated. Good fingers 0.05, noise 0.9."""
FACTOR, CHANGE_A, NEAR = 1.8, 0.15, 0.12
"""Ratio, smallest current (A) and fraction of the travel for a changed pull; good fingers stay within a ratio of 1.5.
"""
ARRIVED_S, LAST, ACROSS = 0.25, 10, 10.0
"""Arrival time of a finger, s; number of readings after it; threshold of lost travel, per cent of the window."""

Recordings = Mapping[str, Recording]
"""Recordings by experiment, in run order."""


def observations(recordings: Recordings, channel: Channel) -> tuple[str, ...]:
    """Return the observations on a channel, sentences without a full stop."""
    found: list[str] = []
    for kind in OBSERVERS:
        with suppress(CannotBeMeasuredError, KeyError):  # short runs lack some recordings
            found += kind(recordings, channel)
    return tuple(found)


def along_its_travel(recordings: Recordings, channel: Channel) -> Iterator[str]:
    """Yield the stretches of a finger's travel where its closing current differs from the other fingers'."""
    closing = {finger: load.spring_a + load.friction_a for finger, load in loads(recordings["staircase"]).items()}
    require(len({len(levels) for levels in closing.values()}) == 1 and _smooth(closing[channel]), "levels")
    others = np.median([closing[finger] for finger in FINGERS if finger is not channel], axis=0)
    beside = (closing[channel] / np.maximum(others, 1e-3))[TAKE_UP:]
    none, much = "next to no current", "{:.1f} times the other fingers' current"
    bands = (none, beside < LITTLE, beside < NONE), (much, beside > HIGH, beside > MUCH)
    for words, differs, clearly in bands if channel in FINGERS else ():
        edges = np.flatnonzero(np.diff(np.concatenate([[False], differs, [False]])))
        for first, end in zip(edges[::2], edges[1::2], strict=True):
            if np.count_nonzero(clearly[first:end]) >= LEVELS:
                start, stop = (100 * (TAKE_UP + i) / (TAKE_UP + len(beside) + 1) for i in (first + 1, end))
                drawn = words.format(np.median(beside[first:end]))
                yield f"it draws {drawn} from {start:.0f} to {stop:.0f} % of its travel"


def per_turn(recordings: Recordings, channel: Channel) -> Iterator[str]:
    """Yield the number of current peaks per spool turn of a channel."""
    recording = recordings["staircase"]
    load = loads(recording)[channel]
    require(len(load.travel_mm) > SMOOTH + 4, "levels")
    travel = np.zeros((len(load.travel_mm), len(Channel)))
    travel[:, channel] = 1e-3 * load.travel_mm
    turns = map_of(recording.header).angles_from_travel(travel)[1:, channel] / (2.0 * np.pi)
    values, span = (load.spring_a + load.friction_a)[1:], float(np.ptp(turns))
    smooth = np.vander((turns - turns.mean()) / max(span, 1e-3), SMOOTH + 1)
    waves = {n: np.exp(2j * np.pi * n * turns) for n in TIMES if n * span > CYCLES}
    fits = {n: _fitted(np.column_stack([smooth, wave.real, wave.imag]), values) for n, wave in waves.items()}
    require(bool(fits), "turns")
    best = min(fits, key=lambda n: fits[n][0])
    left, weights = fits[best]
    amplitude = float(np.hypot(*weights[-2:]))
    explained = left < (1.0 - EXPLAINED) * _fitted(smooth, values)[0]
    if explained and amplitude > max(STRONG * float(np.median(values)), STRONG_A):
        yield f"its current rises and falls {best} times per turn of its spool, by {amplitude:.2f} A"


def since_when(recordings: Recordings, channel: Channel) -> Iterator[str]:
    """Yield the interval of the run in which a finger's current at one position changed."""
    begins = dict(zip(recordings, np.cumsum([0.0, *(r.header.duration_s for r in recordings.values())]), strict=False))
    steps = {name: _closing(recordings[name], channel) for name in ("audit", "holding", "staircase")}
    ends = [begins[name] + closing[-1].end for name, closing in steps.items()]
    load = loads(recordings["staircase"])[channel]
    goals = np.array([step.after for step in steps["staircase"]])[: len(load.spring_a)]
    now = (load.spring_a + load.friction_a)[: len(goals)]
    require(_smooth(now), "a curve")
    changed = ""
    for at, name in enumerate(("audit", "holding") if channel in FINGERS else ()):
        step, currents, side = steps[name][0], recordings[name]["currents"], recordings[name].header.hand
        there = (currents.times > step.start + ARRIVED_S) & (currents.times < step.end)
        pulls = closing_current(currents.values, side)[there, channel]
        before = float(np.median(pulls)) if pulls.size else 0.0
        after = now[np.abs(goals - step.after) < NEAR * MAX_CODE]
        # without current, the finger may not have arrived yet
        if before < CHANGE_A or not after.size or (after.max() * FACTOR > before and after.min() < FACTOR * before):
            break
        until, since = (f"{end:.0f}" for end in ends[at : at + 2])
        changed = f"{before:.2f} A until second {until} of the run, and {np.median(after):.2f} A from {since} on"
    if changed:
        yield f"for the same command it drew {changed}"


def with_the_thumb_across(recordings: Recordings, channel: Channel) -> Iterator[str]:
    """Yield the loss of a channel's travel with the thumb across the palm."""
    name = "coupling" if channel is Channel.THUMB_CMC_FLEXION else "excursion"  # the palm stops only CMC flexion
    codes, commands = recordings[name]["codes"], recordings[name]["command_codes"]
    reached = {}
    for step in find_steps(commands.times, commands.values):
        told = in_force(commands, np.array([step.start]))[0]
        if told[channel] == MAX_CODE and channel is not Channel.THUMB_ABDUCTION:
            last = int(np.searchsorted(codes.times, step.end))
            place = float(np.median(codes.values[max(0, last - LAST) : last, channel]))
            reached[bool(told[Channel.THUMB_ABDUCTION])] = 100.0 * place / MAX_CODE
    if len(reached) == 2 and (alone := reached[False]) - (across := reached[True]) > ACROSS:
        yield f"it goes to {alone:.0f} % of its window, and with the thumb across to {across:.0f} % only"


OBSERVERS = (along_its_travel, per_turn, since_when, with_the_thumb_across)


def _smooth(levels: Floats) -> bool:
    """Return whether a curve is smooth; with encoder jumps, currents cannot be assigned to positions."""
    return len(levels) > SMOOTH + 4 and float(np.median(np.abs(np.diff(levels, 2)))) < ROUGH_A


def _fitted(basis: Floats, values: Floats) -> tuple[float, Floats]:
    """Return the residual sum of squares of a least-squares fit, and its weights."""
    weights = np.asarray(np.linalg.lstsq(basis, values, rcond=None)[0], np.float64)
    return float(np.sum((values - basis @ weights) ** 2)), weights


def _closing(recording: Recording, channel: Channel) -> list[CommandStep]:
    steps = find_steps(recording["command_codes"].times, recording["command_codes"].values)
    found = [step for step in steps if step.channel == channel and step.after > step.before]
    require(bool(found), "closings")
    return found
