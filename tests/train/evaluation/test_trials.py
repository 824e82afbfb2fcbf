"""Which trials are made, and what they came to: all of them, and as figures."""

from dataclasses import replace

import numpy as np
import pytest
from policies import holding

from aero.channels import Channel
from aero.policy.running import Ending, RunSettings, typical_correction
from hil.emulated.emulated_spec import EmulatedSpec
from simulator.scene import CUBE
from train.evaluation.cube_trial import run_trial
from train.evaluation.trials import ANY_CUBE, CORRECTIONS, figures, over_hands

SHORT = RunSettings(seconds=0.2, approach_s=0.2, wait_s=0.1)


@pytest.fixture(scope="module")
def one():
    return run_trial(holding(), EmulatedSpec(unit="ideal", guarded=True, cube=CUBE), SHORT)


def test_any_cube_goes_to_another_corrected_hand_each_right_and_left_in_turn():
    made = over_hands(holding(), 4, seconds=15.0, seed=5, correct="exact")
    assert [case.spec.side for case in made] == ["right", "left"] * 2
    assert {case.name for case in made} == {ANY_CUBE}
    assert len({case.spec.unit for case in made}) == len({case.spec.cube for case in made}) == 4
    assert all(any(case.settings.correction) for case in made)
    again = over_hands(holding(), 3, seconds=15.0, seed=6)
    assert [case.spec.cube for case in again] == [case.spec.cube for case in made[1:]]


def corrections(**how):
    made = over_hands(holding(), 2, seconds=15.0, seed=5, **how)
    return {case.spec.seed: np.array(case.settings.correction) for case in made}


def test_a_correction_is_typical_or_exact_or_none_or_half_a_millimetre_wrong():
    measured, typical, exact, none, wrong = (corrections(correct=how) for how in CORRECTIONS)
    assert {tuple(row) for row in [*typical.values(), *measured.values()]} == {typical_correction()}
    assert list(exact) == list(none) == list(wrong) == [5, 6]
    for seed in (5, 6):
        off = wrong[seed] - exact[seed]
        assert 1e-4 < off.std() < 2e-3
        assert off[Channel.THUMB_ABDUCTION] == 0.0
        assert exact[seed].any()
        assert not none[seed].any()


def test_cables_are_wrong_by_what_is_asked_and_an_exact_correction_knows_it():
    right, wrong = (over_hands(holding(), 1, seconds=1.0, seed=5, correct="exact", cables_m=m)[0] for m in (0.0, 3e-3))
    assert right.spec.conditions is None
    off = np.subtract(wrong.settings.correction, right.settings.correction)
    np.testing.assert_allclose(off[:4], wrong.spec.conditions.pretension_m[:4], atol=3e-4)


def test_a_trial_measures_the_cables_that_its_case_does_not_know():
    (case,) = over_hands(holding(), 1, seconds=0.2, seed=5, cables_m=3e-3)
    told = run_trial(holding(), case.spec, replace(SHORT, correction=case.settings.correction))
    asked = run_trial(holding(), case.spec, SHORT, measured=case.measured)
    assert asked.travel_per_s != told.travel_per_s or asked.rotation_rad != told.rotation_rad


def test_what_trials_came_to_has_intervals(one):
    """Of 18 of 20, Wilson's interval is 69.9 to 97.2 %; that of a mean is about two standard errors to each side."""
    rates = np.random.default_rng(0).normal(0.5, 0.1, 20)
    trials = [replace(one, kept=k < 18, alive_s=15.0, rotation_rad=15.0 * rate) for k, rate in enumerate(rates)]
    found = figures(trials)
    assert (found["survival"], found["turned_share"]) == (0.9, 1.0)
    assert (found["survival_low"], found["survival_high"]) == pytest.approx((0.699, 0.972), abs=0.001)
    error = np.std(rates, ddof=1) / np.sqrt(20)
    assert found["rate_rad_s"] == pytest.approx(rates.mean())
    interval = found["rate_rad_s_low"], found["rate_rad_s_high"]
    assert interval == pytest.approx((rates.mean() - 2 * error, rates.mean() + 2 * error), abs=0.5 * error)
    assert found["rotation_median_rad"] == pytest.approx(15.0 * np.median(rates))


def test_few_trials_have_no_interval_and_equal_ones_an_exact_one(one):
    same = replace(one, alive_s=15.0, rotation_rad=3.0)
    assert np.isnan([figures([same] * 2)[f"rate_rad_s_{end}"] for end in ("low", "high")]).all()
    assert [figures([same] * 3)[f"rate_rad_s_{end}"] for end in ("low", "high")] == [0.2, 0.2]


def test_long_trials_are_counted_after_the_papers_rollout_too(one):
    """One is lost after 10 s, one after 100 s, and two hold the cube for ten minutes."""
    trials = [replace(one, kept=False, alive_s=after) for after in (10.0, 100.0)]
    found = figures([*trials, *[replace(one, kept=True, alive_s=600.0)] * 2])
    assert [found[f"held_{after}_s"] for after in (15, 50, 200)] == [0.75, 0.75, 0.5]
    assert found["held_200_s_low"] < 0.5 < found["held_200_s_high"]
    assert "held_15_s" not in figures([replace(one, kept=True, alive_s=15.0)])


def test_figures_of_trials_are_their_means_and_extremes(one):
    run = replace(one.run, ending=Ending.TIME, peak_current_a=1.0)
    kept = replace(
        one, kept=True, alive_s=2.0, rotation_rad=4.0, airborne=0.2, run=run,
        travel_per_s=(0.01,) * 4 + (9.0,) * 3, mean_currents_a=(0.1,) * 6 + (0.5,),
    )  # fmt: skip
    stopped = replace(
        kept, kept=False, alive_s=1.0, rotation_rad=1.0, airborne=np.nan,
        run=replace(run, ending=Ending.STOPPED, peak_current_a=3.0), travel_per_s=(0.03,) * 4 + (9.0,) * 3,
        mean_currents_a=(0.2,) * 6 + (0.1,),
    )  # fmt: skip
    found = figures([kept, stopped])
    expected = {
        "episodes": 2.0,
        "survival": 0.5,
        "rate_rad_s": 5.0 / 3.0,
        "rotation_median_rad": 2.5,
        "airborne": 0.2,
        "finger_travel_m_s": 0.02,
        "stopped": 0.5,
        "mean_current_a": 0.3,
        "peak_current_a": 3.0,
    }
    assert {name: found[name] for name in expected} == pytest.approx(expected)
