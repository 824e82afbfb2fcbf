"""The tables that are computed from stored campaigns."""

from figures import campaign
from outcomes import outcome

from hil.emulated.faults import parse_fault
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
    ]
    shares = {name: figure for name, figure, _ in campaign.verdict_of(runs)}
    assert shares == {
        "": "figure",
        "healthy hands flagged": "1 of 2",
        "faults found": "2 of 3",
        "part at fault suspected first, of those found": "1 of 2",
        "mistakes of the driver or its map, named so": "-",
    }


def test_healthy_hands_are_counted_by_firmware_and_conditions():
    under = outcome(Trial("plausible:3", seed=3, firmware="pre", conditions=("gravity",)), numbers={})
    header, *rows = campaign.alarms_of([hand((), 1), hand((), 2), under, hand(("motor_dead",), 4)])
    assert [row[:3] for row in rows] == [
        ["0.2.0, 0.1.5", "none", "0 of 2"],
        ["0.2.0, 0.1.5", "all kinds at once", "-"],
        ["pre, 0.1.1, 0.1.2", "none", "-"],
        ["pre, 0.1.1, 0.1.2", "all kinds at once", "0 of 1"],
    ]
    assert all(len(header) == len(row) for row in rows)


def test_faults_are_drawn_once_each():
    drawn = [parse_fault(text) for text in campaign.drawn_faults()]
    assert len({fault.name for fault in drawn}) == campaign.DRAWN
    assert all(fault.severity != fault.fault.steps()[0] or len(fault.fault.steps()) == 1 for fault in drawn)
