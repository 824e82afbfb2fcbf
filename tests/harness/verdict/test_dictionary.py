"""The dictionary is read as it was written."""

import json
from importlib import resources

import pytest

from hil.faults import parse_fault
from hil.verdict.dictionary import DRAWN, FILE, Entry, dictionary_text, load_dictionary

SLACK = Entry(
    "slack", parse_fault("cable_snapped:index=1"), {"own/staircase/take_up": 2.4567, "own/a/b": -1.5, "own/c/d": 0.29}
)


def test_an_entry_is_a_line_with_its_features_in_order_and_to_one_place():
    first, line, last = dictionary_text([SLACK], {"trials": 3}).splitlines()
    assert first == '{"provenance": {"trials": 3}, "entries": ['
    assert list(json.loads(line).items()) == [
        ("fault", "cable_snapped:index=1.0"),
        ("cause", "slack"),
        ("own/a/b", -1.5),
        ("own/staircase/take_up", 2.5),
    ]
    assert last == "]}"


@pytest.mark.parametrize("file", [FILE, DRAWN])
def test_the_dictionary_that_ships_is_read_whole(file):
    text = (resources.files("hil") / "data").joinpath(file).read_text(encoding="utf-8")
    table = json.loads(text)
    entries = load_dictionary(file)
    assert dictionary_text(entries, table["provenance"]) == text
    assert str(entries[0].fault) == table["entries"][0]["fault"]
    assert not {"fault", "cause"} & entries[0].features.keys()
    name = next(name for name in table["entries"][0] if "/" in name)
    assert entries[0].features[name] == table["entries"][0][name]


def test_both_files_that_ship_make_the_dictionary():
    assert load_dictionary() == load_dictionary(FILE) + load_dictionary(DRAWN)
