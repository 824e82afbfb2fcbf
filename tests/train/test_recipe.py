"""A recipe's fingerprint is that of its values."""

from dataclasses import make_dataclass, replace

from train.recipe import PAPER, STEADY, Recipe


def test_a_fingerprint_depends_on_values_alone():
    """Of a class with another name, which `repr` shows, it is the same."""
    renamed = make_dataclass("Renamed", [], bases=(Recipe,), frozen=True)
    same = renamed(**{name: getattr(STEADY, name) for name in STEADY.__dataclass_fields__})
    assert repr(same) != repr(STEADY)
    assert same.fingerprint == STEADY.fingerprint


def test_every_number_counts():
    stages = (replace(STEADY.stages[0], steps=STEADY.stages[0].steps + 1), *STEADY.stages[1:])
    assert len({STEADY.fingerprint, PAPER.fingerprint, replace(STEADY, stages=stages).fingerprint}) == 3
