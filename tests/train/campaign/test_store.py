"""Outcomes survive in the store as they came, each once."""

import math
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from train.campaign.store import StoreError, missing, opened
from train.campaign.trial import Outcome, Trial

NUMBER = st.floats(-1e6, 1e6)
NUMBERS = st.dictionaries(
    st.sampled_from(["audit", "staircase"]),
    st.dictionaries(
        st.sampled_from(["index", "hand"]), st.dictionaries(st.text("ab", min_size=1), NUMBER, min_size=1), min_size=1
    ),
)


def outcome(seed, numbers=None, **more):
    trial = Trial(f"plausible:{seed}", seed=seed, **more)
    return Outcome(trial, numbers or {}, ("audit/followed/index",), "", "", 1.0, 190.0, commit="abc")


@settings(max_examples=10, deadline=None)
@given(NUMBERS)
def test_what_comes_out_is_what_went_in(tmp_path_factory, numbers):
    folder = tmp_path_factory.mktemp("campaign")
    with opened(folder) as store:
        store.add(outcome(3, numbers))
    with opened(folder, read_only=True) as store:
        assert list(store.outcomes()) == [outcome(3, numbers)]


def test_a_number_that_could_not_be_measured_stays_one(tmp_path):
    with opened(tmp_path) as store:
        store.add(outcome(1, {"audit": {"index": {"followed": math.nan}}}))
        (back,) = store.outcomes()
    assert math.isnan(back.numbers["audit"]["index"]["followed"])


def test_a_trial_is_kept_once(tmp_path):
    with opened(tmp_path) as store:
        store.add(outcome(1, {"audit": {"index": {"followed": 1.0}}}))
        store.add(outcome(1, {"audit": {"index": {"followed": 2.0}}}))
        assert [o.numbers["audit"]["index"]["followed"] for o in store.outcomes()] == [1.0]


def test_what_is_missing_is_listed_once_and_in_order():
    trials = [outcome(seed).trial for seed in (4, 1, 4, 2)]
    assert [trial.seed for trial in missing(trials, frozenset({trials[1].key}))] == [4, 2]


@pytest.mark.parametrize(
    "change",
    [
        {"side": "left"},
        {"firmware": "0.1.5"},
        {"homed": False},
        {"faults": ("motor_dead",)},
        {"experiments": ("audit",)},
    ],
)
def test_trials_that_differ_have_different_keys(change):
    assert outcome(1, **change).trial.key != outcome(1).trial.key


def test_a_folder_without_a_campaign_is_named(tmp_path: Path):
    with pytest.raises(ValueError, match="no campaign in"), opened(tmp_path, read_only=True):
        pass


def test_a_file_that_is_no_store_is_named(tmp_path: Path):
    (tmp_path / "campaign.duckdb").write_text("not a database, but long enough to be looked at" * 10)
    with pytest.raises(ValueError, match="cannot open the campaign"), opened(tmp_path):
        pass


def test_a_folder_whose_name_is_not_text_is_one_line(tmp_path):
    folder = tmp_path / "caf\udce9"
    with pytest.raises(StoreError, match="UTF-8"), opened(folder):
        pass


def test_ctrl_c_in_a_query_is_ctrl_c(tmp_path):
    with pytest.raises(KeyboardInterrupt), opened(tmp_path):
        raise RuntimeError("Query interrupted")
