"""The score of a unit on recordings: what the phase alone does to its own, and the hand's own differences beside it."""

import dataclasses
from functools import cache

import numpy as np
import pytest

from aero.actuation import CommandWindow
from model.units import load_unit
from train.identification.replay_score import rise
from train.identification.replay_score import score as scored
from train.identification.trace import Trace
from train.identification.trace_replay import replay
from train.identification.unit_parameters import PHASES_S

UNIT = load_unit("reference")


@cache
def recorded(seed, *, shift=0.0, level=30000):
    """What the reference unit itself would leave of a short run."""
    t_command = np.arange(0.0, 2.0, 0.05) + shift
    codes = np.full((len(t_command), 7), 8000)
    codes[10:25] = level
    t_read = t_command + 0.02
    spans = CommandWindow.for_firmware("0.2.0").spans_counts().astype(float)
    blank = Trace(f"run {seed}", t_command, codes, t_read, *[np.zeros((len(t_read), 7))] * 3, spans, "right", "0.2.0")
    read = replay(blank, UNIT, seed=seed)
    return dataclasses.replace(
        blank, counts=read.counts, currents=read.currents, temperatures=np.trunc(read.temperatures)
    )


def score(traces, unit, phases_s=PHASES_S):
    return scored(traces, [[replay(trace, unit, phase_s=phase) for phase in phases_s] for trace in traces])


def test_a_unit_scores_on_its_own_recording_what_the_phase_alone_does():
    result = score([recorded(0)], UNIT)
    assert np.sqrt(np.mean(result.all_runs.counts**2)) < 80
    assert np.isnan(result.repeats.counts).all()
    assert result.all_runs.warming_c.max() <= 1.0
    assert [name for name, _ in result.runs] == ["run 0"]


def test_the_hands_own_differences_come_from_runs_of_the_same_commands():
    first, again, different = recorded(0), recorded(1, shift=5.0), recorded(2, level=40000)
    repeats = score([first, again, different], UNIT).repeats
    assert np.nanmax(repeats.counts) < 5.0
    assert np.nanmax(repeats.currents_a) < 0.1
    moved = dataclasses.replace(again, counts=again.counts + 7.0)
    assert score([first, moved], UNIT).repeats.counts == pytest.approx(np.full(7, 7.0), abs=3.0)


def test_the_hands_own_differences_are_by_channel():
    first = recorded(0)
    codes = first.codes.copy()
    codes[:, 5] += 100
    moved = dataclasses.replace(first, codes=codes, counts=first.counts + 7.0)
    repeats = score([first, moved], UNIT).repeats.counts
    assert np.isnan(repeats[5])
    assert np.delete(repeats, 5) == pytest.approx(np.full(6, 7.0), abs=1e-9)


def test_a_rise_needs_two_readings():
    temperatures = np.full((4, 7), np.nan)
    temperatures[1, 0], temperatures[3, 0], temperatures[2, 1] = 30.0, 33.0, 30.0
    assert rise(temperatures)[0] == 3.0
    assert np.isnan(rise(temperatures)[1:]).all()
