"""The typical correction that ships: as its command makes it, and near what fresh hands need."""

import tomllib

import numpy as np

from aero.channels import Channel
from aero.policy.running import NO_CORRECTION, typical_correction
from aero.policy.settings import PAPER_DEPLOYMENT
from aero.policy.shipped import DEFAULT, find_policy
from model.units.cable_correction import correction, named_correction
from model.units.plausible import unit_named
from train.typical_correction import SEEDS, as_toml, corrections_of

SAMPLE = 12


def test_hands_of_its_population_stand_around_it():
    """Fingers differ by 0.9 mm, the thumb's two cables by 0.04 and 0.11 mm; a changed population shows here."""
    rows = 1e3 * (corrections_of(SEEDS[:SAMPLE], find_policy(DEFAULT).settings))
    off = rows.mean(axis=0) - 1e3 * np.array(typical_correction())
    assert np.abs(off[:4]).max() < 0.9
    assert np.abs(off[4:]).max() < 0.1


def test_the_file_holds_the_mean_and_names_its_hands():
    rows = np.arange(7.0) + np.array([[-0.5], [0.0], [0.5]])
    text = as_toml(rows)
    assert "plausible:700000 to plausible:700199" in text
    assert tomllib.loads(text)["mean"] == {channel.label: float(channel) for channel in Channel}


def test_a_correction_has_a_name():
    assert tuple(named_correction("typical", PAPER_DEPLOYMENT)) == typical_correction()
    assert tuple(named_correction("none", PAPER_DEPLOYMENT)) == NO_CORRECTION
    own = correction(unit_named("plausible:4"), PAPER_DEPLOYMENT)
    np.testing.assert_array_equal(named_correction("plausible:4", PAPER_DEPLOYMENT), own)
