"""The tables that are computed from stored campaigns."""

from figures import campaign
from outcomes import outcome

from train.campaign.trial import Trial


def hand(fault, seed, **more):
    return outcome(Trial(f"plausible:{seed}", seed=seed, faults=fault), numbers={}, **more)


def test_shares_of_found_and_of_the_right_part(monkeypatch):
    monkeypatch.setattr(campaign, "MISTAKES", {})
    monkeypatch.setattr(campaign, "MISTAKES_OF_THE_MAP", {})
    stopped = {"stopped": "it stopped", "ended": "SafetyStopError"}
    runs = [
        hand((), 1),
        hand((), 2, **stopped),
        hand(("motor_dead:ring=1.0",), 3),
        hand(("motor_dead:ring=1.0",), 4, **stopped, suspects=("SERVO/ring", "DIGIT/ring")),
        hand(("motor_dead:ring=1.0",), 5, **stopped, suspects=("SERVO/index",)),
        hand(("supply_low=0.4",), 6, **stopped, suspects=("SUPPLY",)),
    ]
    shares = {name: figure for name, figure, _ in campaign.verdict(runs)}
    assert shares == {
        "": "figure",
        "healthy hands flagged": "1 of 2",
        "faults found": "3 of 4",
        "part at fault suspected first, of those found": "2 of 3",
        "supply lower by 0.4: found there": "1 of 1",
        "mistakes of the driver or its map, named so": "-",
    }


def test_healthy_hands_are_counted_by_their_conditions():
    under = outcome(Trial("plausible:3", seed=3, conditions=("gravity",)), numbers={})
    header, without, with_all = campaign.alarms([hand((), 1), hand((), 2), under, hand(("motor_dead",), 4)])
    assert without[:3] == ["none", "1 to 2", "0 of 2"]
    assert with_all[:3] == ["all kinds at once", "3 to 3", "0 of 1"]
    assert len(header) == len(without)
