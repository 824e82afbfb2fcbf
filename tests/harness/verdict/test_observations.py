"""A curve made for each kind of observation gives its sentence, in the right place; a good one gives none."""

import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from synthetic import HEADER, RANGES, held, replaced, staircase

from aero.actuation import ActuationMap
from aero.channels import FINGERS, Channel
from aero.protocol import MAX_CODE
from hil.emulated.any_hand import open_target
from hil.emulated.faults import parse_fault
from hil.verdict.observations import observations
from hil.verdict.validation import judge_recordings, validate

LEVELS = 20
SIGNS = np.array([1, 1, 1, 1, 1, 1, -1])


def pull(part):
    """The current that a good finger draws at a part of its range, A."""
    return np.where(part > 0.0, 0.4 + 0.3 * part, 0.0)


STAIRS = staircase(levels=LEVELS)
PART = STAIRS["command"].values / RANGES
GOOD = replaced(STAIRS, "currents", SIGNS * pull(PART))
NEXT = dict(zip(Channel, [*[*Channel][1:], Channel.INDEX], strict=True))
"""Another channel to each, on which nothing is to be seen."""
ANY_FINGER = st.sampled_from(FINGERS)


def swept(finger, currents):
    """A staircase in which one finger pulls otherwise; `currents` gives them for its part of the range."""
    values = GOOD["currents"].values.copy()
    values[:, finger] = currents(PART[:, finger])
    return {"staircase": replaced(GOOD, "currents", values)}


def one_after_another(part, *, fist=None):
    """Postures: each channel closed by a part of its window and opened, then fingers and fist where one is wanted."""
    codes = np.zeros((15, 7))
    codes[np.arange(1, 15, 2), np.arange(7)] = part * MAX_CODE
    return codes if fist is None else np.vstack([codes, np.outer([1, 0], [*[MAX_CODE] * 4, 0, 0, 0]), fist, fist * 0])


def timed(recording):
    """The recording, with its length in its header as a recorder writes it."""
    return replace(recording, header=replace(recording.header, duration_s=float(recording["codes"].times[-1])))


def whole_run(finger=None, audit=1.0, holding=1.0, staircase=None):
    """Audit, holding and staircase of a hand whose finger pulled so many times as much in the first two."""
    nudges = one_after_another(0.2)
    grasp = np.array([np.zeros(7), np.full(7, 0.5 * MAX_CODE), np.zeros(7)])
    run = {}
    for name, postures, hold_s, factor in (("audit", nudges, 0.6, audit), ("holding", grasp, 2.0, holding)):
        recording = held(name, postures, hold_s)
        currents = SIGNS * pull(recording["command_codes"].values / MAX_CODE)
        if finger is not None:
            currents[:, finger] *= factor
        run[name] = timed(replaced(recording, "currents", currents))
    return {**run, "staircase": staircase or GOOD}


@given(ANY_FINGER, st.integers(2, 12), st.integers(4, 7), st.sampled_from([0.0, 3.5, 6.0]))
def test_where_a_finger_draws_another_current_is_said_to_a_level(finger, first, length, factor):
    last = min(first + length, LEVELS - 1)
    differs = lambda part: (part > (first + 0.5) / LEVELS) & (part < (last + 0.5) / LEVELS)  # noqa: E731
    run = swept(finger, lambda part: pull(part) * np.where(differs(part), factor, 1.0))
    (said,) = (one for one in observations(run, finger) if "it draws" in one)
    start, stop = map(int, re.search(r"from (\d+) to (\d+) %", said).groups())
    assert ("next to no current" in said) == (factor == 0.0)
    assert abs(start - 100 * (first + 1) / LEVELS) <= 1
    assert abs(stop - 100 * last / LEVELS) <= 1
    assert observations(run, NEXT[finger]) == ()


@given(ANY_FINGER, st.integers(2, 8), st.floats(0.25, 0.5), st.floats(0.0, 6.0))
def test_what_comes_again_in_each_turn_of_the_spool_is_counted(finger, times, amplitude, phase):
    codec = ActuationMap.for_firmware(HEADER.firmware)
    turns = codec.angles_from_travel(GOOD["command"].values)[:, finger] / (2.0 * np.pi)
    wave = amplitude * np.sin(2.0 * np.pi * times * turns + phase)
    run = swept(finger, lambda part: pull(part) + np.where(part > 0, wave, 0.0))
    said = f"its current rises and falls {times} times per turn of its spool, by {amplitude:.2f} A"
    assert said in observations(run, finger)


@given(ANY_FINGER, st.floats(2.5, 8.0), st.booleans())
def test_a_pull_that_changed_is_placed_between_the_experiments_that_show_it(finger, factor, before_holding):
    run = whole_run(finger, factor, 1.0 if before_holding else factor)
    (said,) = observations(run, finger)
    until, since = map(int, re.search(r"until second (\d+) of the run, .* A from (\d+) on", said).groups())
    audit_s, holding_s = 0.6 * 15, 2.0 * 3
    assert 0.6 < until < audit_s + holding_s
    assert (until <= audit_s) == before_holding
    assert since > until


@given(st.sampled_from([*FINGERS, Channel.THUMB_FLEXOR]), st.floats(0.0, 0.85))
def test_a_channel_that_goes_less_far_with_the_thumb_across_is_said_so(channel, part):
    postures = one_after_another(1.0, fist=np.full((1, 7), MAX_CODE))
    answer = postures.copy()
    answer[-2, channel] *= part
    run = {"excursion": held("excursion", postures, 0.9, answer=answer)}
    assert observations(run, channel) == (
        f"it goes to 100 % of its window, and with the thumb across to {100 * part:.0f} % only",
    )
    assert observations(run, NEXT[channel]) == ()


@given(st.floats(0.7, 1.4), st.floats(0.7, 1.4), ANY_FINGER, st.floats(0.5, 2.7))
def test_a_good_hand_shows_nothing(audit, holding, finger, stiffer):
    stairs = swept(finger, lambda part: stiffer * pull(part))["staircase"]
    run = whole_run(finger, stiffer * audit, stiffer * holding, stairs)
    postures = one_after_another(1.0, fist=np.full((1, 7), MAX_CODE))
    run["excursion"] = held("excursion", postures, 0.9, answer=0.95 * postures)
    assert [*observations(run, finger), *observations(run, NEXT[finger])] == []


@pytest.mark.parametrize("levels", [1, 2, 3, 5])
def test_a_run_that_is_too_short_shows_nothing(levels):
    run = {"staircase": staircase(levels=levels)}
    assert not [one for channel in Channel for one in observations(run, channel)]
    assert not [one for channel in Channel for one in observations({}, channel)]


def run_of(*faults):
    with open_target(unit="plausible:470000", seed=470000, homed=True, faults=faults) as target:
        return validate(target)


def test_an_emulated_finger_that_loses_its_springs_shows_where_and_since_when():
    run = run_of(parse_fault("spring_off:middle=1@45"))
    where, since = run.diagnosis.observations
    assert where == "Middle finger: it draws next to no current from 15 to 95 % of its travel"
    assert re.fullmatch(r"Middle finger: for the same command it drew 0\.\d+ A until second \d .* A from 4\d on", since)
    # Files come in any order: what counts is when each experiment began.
    files = [result.recording for result in run.results.values()]
    assert judge_recordings(files[::-1]).diagnosis.observations == (where, since)


def test_a_healthy_emulated_hand_shows_nothing():
    recordings = {name: result.recording for name, result in run_of().results.items()}
    assert not [one for channel in Channel for one in observations(recordings, channel)]
