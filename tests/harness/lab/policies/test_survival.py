"""How long a policy keeps the cube: shares on trials whose answer is known, and the picture."""

from dataclasses import replace

import pytest
from policies import holding

from aero.policy.running import RunSettings
from hil.lab.policies import byte_evaluation
from hil.lab.policies.cube_trial import run_trial
from hil.lab.policies.survival import LONG_S, MOMENTS_S, still_held, survival_picture
from model.units import load_unit


@pytest.fixture(scope="module")
def one():
    return run_trial(holding(), load_unit("ideal"), settings=RunSettings(seconds=0.2, approach_s=0.2, wait_s=0.1))


@pytest.fixture
def trials(one):
    """One is lost after 10 s, one after 100 s, and two hold for all of the time."""
    lost = [replace(one, kept=False, alive_s=after) for after in (10.0, 100.0)]
    return [*lost, *[replace(one, kept=True, alive_s=LONG_S)] * 2]


def test_the_share_falls_when_a_trial_is_lost_and_its_interval_holds_it(trials):
    found = still_held(trials)
    assert [one.after_s for one in found] == list(MOMENTS_S)
    assert [one.share for one in found] == [0.75, 0.75, 0.5, 0.5]
    assert all(0.0 <= low < one.share < high <= 1.0 for one in found for low, high in [one.interval])


def test_the_picture_has_a_line_for_each_row(trials, tmp_path):
    survival_picture({"reference": trials, "paper": trials[:1]}, tmp_path / "survival.png")
    assert (tmp_path / "survival.png").stat().st_size > 10_000


def test_long_trials_are_long_and_corrected_and_every_random_one_is_another_hand():
    made = byte_evaluation.over_long(holding(), 2, seed=5)
    assert [case.name for case in made] == ["reference"] * 2 + ["paper"] * 2 + ["random units"] * 2
    assert {case.settings.seconds for case in made} == {LONG_S}
    assert all(any(case.settings.correction) for case in made)
    assert len({case.unit.name for case in made[4:]}) == 2
    assert len({case.seed for case in made[:2]}) == 2
