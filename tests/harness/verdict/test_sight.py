"""What a check can see, in words and as data."""

import json
from importlib import resources

import pytest

from hil.faults.fault import quantity
from hil.verdict.sight import Seen, Sight, load_sight, sight_text

EIGHT = tuple(Seen(f"fault_{i}", 0.1 * i, "N m" if i % 2 else "", 5) for i in range(1, 9))


def test_the_first_six_faults_are_named_and_the_others_counted():
    start = "This check accused 1 of 69 healthy hands (at most 5.2%)."
    assert Sight(1, 69, 0.052, ()).sentence == f"{start} It found no fault of the catalogue on every hand."
    assert Sight(1, 69, 0.052, EIGHT[:2]).sentence == (
        f"{start} It found on every hand that had it: fault 1 from 0.1 N m on, fault 2."
    )
    assert Sight(1, 69, 0.052, EIGHT[:6]).sentence.endswith("fault 5 from 0.5 N m on, fault 6.")
    assert Sight(1, 69, 0.052, EIGHT).sentence.endswith("fault 5 from 0.5 N m on, fault 6 and 2 more.")


def test_what_is_written_is_what_ships():
    shipped = json.loads((resources.files("hil") / "data").joinpath("sight.json").read_text(encoding="utf-8"))
    assert json.loads(sight_text(load_sight(), shipped["provenance"])) == shipped
    assert all(isinstance(seen, Seen) for sight in load_sight().values() for seen in sight.sees)


def test_checks_are_written_in_the_order_of_their_names():
    text = sight_text({"b/x": Sight(0, 1, 0.9, ()), "a/x": Sight(0, 1, 0.9, EIGHT[:1])}, {"hands": 1})
    table = json.loads(text)
    assert list(table["checks"]) == ["a/x", "b/x"]
    assert table["checks"]["a/x"]["sees"] == [{"fault": "fault_1", "severity": 0.1, "unit": "N m", "hands": 5}]
    assert text.startswith('{\n "provenance"')
    assert text.endswith("}\n")


@pytest.mark.parametrize(
    ("severity", "unit", "words"),
    [
        (60, "6.5 mA", "390 mA"),
        (0.05, "of replies", "5 % of replies"),
        (1.1, "factor", "a factor of 1.1"),
        (15, "ms", "15 ms"),
    ],
)
def test_severities_are_told_in_units_that_people_know(severity, unit, words):
    """The protection current of the servo counts in steps of 6.5 mA."""
    assert quantity(severity, unit) == words
