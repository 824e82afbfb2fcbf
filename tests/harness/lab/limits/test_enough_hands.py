"""Limits are made from enough healthy hands, or not at all."""

import pytest
from click.testing import CliRunner
from outcomes import outcome

from hil.cli import main
from hil.lab.campaign.plan import healthy_hands
from hil.lab.campaign.population import require_enough
from hil.lab.campaign.store import opened


def hands(count):
    return [outcome(trial) for trial in healthy_hands(0, count)]


@pytest.mark.parametrize("count", [1, 8, 106])
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
        require_enough([hand for hand in hands(400) if not hand.trial.guarded])
