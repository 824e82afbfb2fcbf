"""The population that limits are made from, and how well limits hold hands that they were not made from."""

import subprocess
import sys
import tomllib
from collections import Counter
from dataclasses import replace

import pytest
from click.testing import CliRunner
from outcomes import numbers, outcome

from aero.firmware import VERSION_GROUPS
from hil.checks import DEFAULT
from hil.verdict.limits import TABLE, load_limits, parse_limits
from train.campaign.store import opened
from train.campaign.trial import perform
from train.limits.__main__ import limits
from train.limits.population import drawn, held_out

WHOLE = [trial for trial in drawn() if trial.experiments == DEFAULT]
PROVENANCE = tomllib.loads(TABLE.parent.joinpath("population.toml").read_text(encoding="utf-8"))


def test_every_kind_of_healthy_hand_is_drawn_alike_often():
    assert len({trial.key for trial in drawn()}) == len(drawn())
    assert not any(trial.faults for trial in drawn())
    kinds = Counter((t.firmware, t.side, t.guarded, bool(t.conditions)) for t in WHOLE)
    versions = {trial.firmware for trial in WHOLE}
    assert len(kinds) == 8 * len(versions)
    assert {next(i for i, group in enumerate(VERSION_GROUPS) if named in group) for named in versions} == set(
        range(len(VERSION_GROUPS))
    )
    for named in versions:
        assert len({count for kind, count in kinds.items() if kind[0] == named}) == 1


@pytest.mark.parametrize("part", [1, 2, 4])
def test_a_beginning_of_the_population_has_each_firmware_in_its_share(part):
    some, every = (Counter(t.firmware for t in trials) for trials in (WHOLE[: len(WHOLE) // part], WHOLE))
    assert all(abs(part * some[named] - count) <= 2 * part for named, count in every.items())


def test_the_table_says_what_it_was_made_from():
    assert PROVENANCE["hands"] == len(drawn())
    assert PROVENANCE["seeds"] == [min(t.seed for t in drawn()), max(t.seed for t in drawn())]
    assert PROVENANCE["command"].startswith("python -m train.limits")
    assert PROVENANCE["commit"]
    flagged, judged = PROVENANCE["flagged_by_the_others"]
    assert judged == len(drawn())
    assert flagged < 0.05 * judged


@pytest.mark.slow
@pytest.mark.parametrize("place", [2, 3, 317])
def test_a_hand_of_the_population_reads_within_the_range_of_the_table(place):
    """A reading that moved says that the table is out of date: `python -m train.limits`."""
    trial = WHOLE[place]
    measured = perform(trial).numbers
    moved = {
        (limit.experiment, limit.metric, subject): value
        for limit in load_limits(trial.firmware, guarded=trial.guarded)
        for subject in limit.subjects
        if limit.healthy is not None
        and (value := measured.get(limit.experiment, {}).get(subject, {}).get(limit.metric)) is not None
        # The range has six figures.
        and not limit.healthy[0] - 1e-5 * abs(value) <= value <= limit.healthy[1] + 1e-5 * abs(value)
    }
    assert moved == {}


def everybody(count=160):
    return [outcome(trial) for trial in drawn()[:count]]


def test_hands_that_limits_were_not_made_from_are_judged_by_them():
    """All read alike but for the last, which limits from the others accuse."""
    every = everybody()
    assert held_out(every) == (0, 160)
    odd = replace(every[-1], numbers=numbers(staircase__friction__index=9.0))
    assert held_out([*every[:-1], odd]) == (1, 160)


def test_a_campaign_that_is_complete_makes_a_table_that_holds_it(tmp_path, monkeypatch):
    monkeypatch.setattr("train.cli.campaign.source_commit", lambda: "abc")
    with opened(tmp_path / "campaign") as store:
        for trial in drawn():
            store.add(outcome(trial, numbers=numbers(trial.seed // 16 % 4)))
    result = CliRunner().invoke(limits, ["--out", str(tmp_path / "campaign")])
    assert result.exit_code == 0, result.output
    assert f"flag 0 of the other {len(drawn())}" in result.output
    made = parse_limits((tmp_path / "campaign" / "limits.csv").read_text())
    shipped = parse_limits(TABLE.read_text(encoding="utf-8"))
    assert {(one.experiment, one.metric) for one in made} == {(one.experiment, one.metric) for one in shipped}
    provenance = tomllib.loads((tmp_path / "campaign" / "population.toml").read_text())
    assert provenance["commit"] == "abc"


def test_a_store_of_another_commit_is_refused(tmp_path):
    """Its numbers may differ from those of this program."""
    with opened(tmp_path) as store:
        store.add(outcome(drawn()[0]))
    before = (tmp_path / "campaign.duckdb").read_bytes()
    command = [sys.executable, "-m", "train.limits", "--out", str(tmp_path)]
    result = subprocess.run(command, capture_output=True, text=True, check=False, cwd=tmp_path)
    assert result.returncode == 2
    assert "has runs of commit 'abc', this program is of" in result.stderr
    assert (tmp_path / "campaign.duckdb").read_bytes() == before
    assert not (tmp_path / "limits.csv").exists()
