"""Trials of any cube by what the cube is like: shares on trials whose answer is known, and the picture."""

from dataclasses import replace

import numpy as np
import pytest
from policies import holding

from aero.channels import Channel
from aero.policy.running import RunSettings
from hil.lab.policies.any_cube import ANY_CUBE, DISTURBANCES, MEASURED, over_any, over_corrections, over_disturbances
from hil.lab.policies.cube_trial import Surroundings, run_trial
from hil.lab.policies.strata import DIVISIONS, strata, strata_picture
from model.cubes import TAILS
from model.scene import CUBE
from model.units import load_unit

SHORT = RunSettings(seconds=0.2, approach_s=0.2, wait_s=0.1)


@pytest.fixture(scope="module")
def one():
    return run_trial(holding(), load_unit("ideal"), settings=SHORT)


def trial(one, *, kept, rate, side="right", **cube):
    surroundings = Surroundings(replace(CUBE, **cube), side)
    return replace(one, kept=kept, alive_s=1.0, rotation_rad=rate, surroundings=surroundings)


@pytest.fixture
def trials(one):
    """Sticky cubes are lost, heavy ones do not turn, and all others turn at 1 rad/s."""
    return [
        *[trial(one, kept=False, rate=1.0, friction=0.9)] * 3,
        *[trial(one, kept=True, rate=0.05, mass_kg=0.12, side="left")] * 2,
        *[trial(one, kept=True, rate=1.0)] * 5,
    ]


def test_each_stratum_tells_its_own_trials(trials):
    found = {row.label: row for row in strata(trials)}
    assert (found["all"].trials, found["all"].kept, found["all"].turned) == (10, 0.7, 0.8)
    sticky, heavy = found["friction 0.8 to 1"], found["mass, g, 110 to 140"]
    assert (sticky.trials, sticky.kept, sticky.turned) == (3, 0.0, 1.0)
    assert (heavy.trials, heavy.kept, heavy.turned, heavy.rate_rad_s) == (2, 1.0, 0.0, pytest.approx(0.05))
    assert found["side, mm, 45 to 49"].trials == 0
    assert (found["left hand"].trials, found["right hand"].trials) == (2, 8)
    for row in found.values():
        low, high = row.kept_interval
        assert 0.0 <= low <= high <= 1.0
        assert not row.trials or low <= row.kept <= high


def test_every_trial_is_in_one_stratum_of_each_division(trials):
    rows = strata(trials)
    for division in DIVISIONS:
        assert sum(row.trials for row in rows if row.label.startswith(division.name)) == len(trials)


def test_the_upper_strata_are_the_tails_that_training_draws_from():
    scales = {"friction": 1.0, "mass": 1e3, "side": 1e3}
    for division in DIVISIONS:
        (name,) = [name for name in TAILS if division.name.startswith(name)]
        assert division.edges[-2:] == pytest.approx([scales[name] * end for end in TAILS[name]])


def test_the_picture_is_drawn(trials, tmp_path):
    strata_picture(trials, tmp_path / "strata.png")
    assert (tmp_path / "strata.png").stat().st_size > 10_000


def test_any_cube_goes_to_another_corrected_hand_each_right_and_left_in_turn():
    made = over_any(holding(), 4, seconds=15.0, seed=5)
    assert [case.surroundings.side for case in made] == ["right", "left"] * 2
    assert {case.name for case in made} == {ANY_CUBE}
    assert len({case.unit.name for case in made}) == len({case.surroundings.cube for case in made}) == 4
    assert all(any(case.settings.correction) for case in made)
    again = over_any(holding(), 3, seconds=15.0, seed=6)
    assert [case.surroundings.cube for case in again] == [case.surroundings.cube for case in made[1:]]


def test_each_disturbance_comes_to_the_same_hands_and_cubes():
    made = over_disturbances(holding(), 2, seconds=15.0, seed=5)
    assert len(made) == 2 * len(DISTURBANCES)
    assert len({(case.unit.name, case.surroundings.cube, case.seed) for case in made}) == 2
    assert len({case.surroundings.disturbance for case in made}) == len(DISTURBANCES)


def test_a_correction_is_exact_or_none_or_wrong_or_what_a_unit_file_says(tmp_path):
    (tmp_path / "6.toml").write_text('description = "a hand as the default one"\n')
    made = over_corrections(holding(), 2, seconds=15.0, seed=5, twins=tmp_path)
    rows = {}
    for case in made:
        rows.setdefault(case.name, {})[case.seed] = np.array(case.settings.correction)
    exact, wrong = rows["corrected exactly"], rows["corrected, 0.5 mm wrong"]
    assert {name: sorted(row) for name, row in rows.items()} == {
        "corrected exactly": [5, 6],
        "not corrected": [5, 6],
        "corrected, 0.5 mm wrong": [5, 6],
        MEASURED: [6],
    }
    assert not any(row.any() for row in rows["not corrected"].values())
    for seed in (5, 6):
        off = wrong[seed] - exact[seed]
        assert 1e-4 < off.std() < 2e-3
        assert off[Channel.THUMB_ABDUCTION] == 0.0
    assert not np.allclose(rows[MEASURED][6], exact[6], atol=1e-5)
    with pytest.raises(ValueError, match=r"5\.toml"):
        over_corrections(holding(), 1, seconds=15.0, seed=5, twins=tmp_path)


def test_a_left_hand_mirrors_the_right_one():
    """Exactly, but for where the cube is put: a person does not mirror that."""
    made = {}
    for side in ("right", "left"):
        lengths = []
        run_trial(
            holding(), load_unit("reference"), settings=SHORT, surroundings=Surroundings(side=side),
            on_step=lambda step, kept=lengths: kept.append(step.lengths),
        )  # fmt: skip
        made[side] = np.array(lengths)
    np.testing.assert_allclose(made["left"], made["right"], atol=2e-3)
