"""Limits are made from enough healthy hands, or not at all."""

import tomllib
from dataclasses import replace

import pytest
from click.testing import CliRunner
from outcomes import numbers, outcome

from hil.checks import WHOLE_RUN
from hil.cli import main
from hil.verdict.limits import read_provenance
from train.campaign.store import opened
from train.campaign.trial import healthy_hands
from train.cli.limits import _beside, limits_text
from train.limits.population import held_out, require_enough


def hands(count):
    return [outcome(trial) for trial in healthy_hands(0, count)]


@pytest.mark.parametrize("count", [1, 8])
def test_limits_of_a_few_hands_are_refused_and_nothing_is_written(count, tmp_path):
    with opened(tmp_path / "campaign") as store:
        for hand in hands(count):
            store.add(hand)
    result = CliRunner().invoke(main, ["limits", str(tmp_path / "campaign"), "--out", str(tmp_path / "out")])
    assert result.exit_code == 2
    assert "54 of each are needed" in result.output
    assert "--healthy 112" in result.output
    assert not (tmp_path / "out").exists()


def test_the_hands_that_the_refusal_asks_for_are_enough():
    """54 = 8 excesses in a tail of 15 %, without a guard and with one."""
    require_enough(hands(112))
    with pytest.raises(ValueError, match="too few for limits"):
        require_enough(hands(106))
    with pytest.raises(ValueError, match="too few for limits"):
        require_enough([hand for hand in hands(400) if not hand.trial.guarded])


def test_hands_that_limits_were_not_made_from_are_judged_by_them():
    """All read alike but for the last, which limits from the others accuse."""
    every = hands(160)
    assert held_out(every, ("staircase",)) == (0, 160)
    odd = replace(every[-1], numbers=numbers(staircase__friction__index=9.0))
    assert held_out([*every[:-1], odd], ("staircase",)) == (1, 160)


def test_a_few_hands_widen_the_limits_that_ship_and_a_kept_hand_is_among_the_healthy(tmp_path):
    far = replace(hands(1)[0], numbers=numbers(staircase__friction__index=9.0))
    with opened(tmp_path / "campaign") as store:
        store.note_command(f"__main__.py campaign --healthy 1 --out {tmp_path}/campaign")
        store.add(far)
    command = ["limits", str(tmp_path / "campaign"), "--out", str(tmp_path / "out"), "--widen"]
    result = CliRunner().invoke(main, command)
    assert result.exit_code == 0, result.output
    assert "limits widened for 1 healthy hands" in result.output
    table = tomllib.loads((tmp_path / "out" / "aero_hand_open.toml").read_text())
    friction = [limit for limit in table["limit"] if limit["metric"] == "friction" and "index" in limit["subjects"]]
    friction = [limit for limit in friction if not limit.get("guarded")]  # this hand is not
    assert {limit["at_most"] > 9.0 for limit in friction if "0.2.0" in limit["firmware"]} == {True}
    assert {limit["at_most"] > 9.0 for limit in friction if "pre" in limit["firmware"]} == {False}
    assert table["provenance"]["hands"] == read_provenance("aero_hand_open")["hands"]
    last = max(name for name in table["provenance"] if name.startswith("widened"))
    assert table["provenance"][last]["hands"] == 1
    assert table["provenance"][last]["commands"][0] == "aero-hil campaign --healthy 1 --out campaign"


def test_a_kind_that_hands_only_widened_has_no_empty_provenance():
    text = limits_text((), {"widened_1": {"hands": 1}}, extends="aero_hand_open")
    assert tomllib.loads(text)["provenance"] == {"widened_1": {"hands": 1}}
    assert "[provenance]" not in text


def test_limits_that_are_made_anew_keep_no_provenance_of_what_widened_the_old_ones():
    present = {"hands": 1, "widened_1": {"hands": 2}, "window": {"hands": 3}, "staircase": {"hands": 4}}
    assert _beside(present, {"hands": 5}, {"staircase", WHOLE_RUN.name}) == {"hands": 5, "window": {"hands": 3}}
    assert _beside(present, {"hands": 5}, {"window"}) == {**present, "window": {"hands": 5}}
