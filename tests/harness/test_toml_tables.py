"""A table fills exactly the fields that it names; each mistake is one line with its table and key."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Literal

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec import Meta

from aero_hil_toml import filled, parsed


@dataclass(frozen=True)
class Inner:
    depth_m: float = 1.0


@dataclass(frozen=True)
class Toy:
    slack_m: float
    turns: Annotated[int, Meta(ge=0)] = 3
    stretchy: bool = True
    radii_m: tuple[float, float] = (1.0, 2.0)
    side: Literal["right", "left"] = "right"
    inner: Inner = field(default_factory=Inner)
    rows: tuple[Inner, ...] = ()
    named: Mapping[str, float] = field(default_factory=dict)
    file: Path = Path()
    turn: Literal[1, -1] = 1
    modes: tuple[Literal["a", "b"], ...] = ()


@given(st.floats(-9, 9), st.integers(0, 9), st.booleans(), st.lists(st.floats(-9, 9), min_size=2, max_size=2))
def test_every_key_lands_in_its_field(slack, turns, stretchy, radii):
    inner = {"depth_m": slack}
    table = {"slack_m": slack, "turns": turns, "stretchy": stretchy, "radii_m": radii, "inner": inner, "rows": [inner]}
    wanted = Toy(slack, turns, stretchy, (radii[0], radii[1]), "right", Inner(slack), (Inner(slack),))
    assert filled(Toy, table, "toy") == wanted


MISTAKES = {
    "= 3": "toy is not TOML",
    "a = " + "[" * 100_000: "toy is not TOML",
    "": "toy: missing key `slack_m`",
    "slack = 1.0": r"toy: unknown key `slack`; did you mean `slack_m`\? known are slack_m, turns, .*, modes",
    "slack_m = true": "toy.slack_m: expected `float`, got `bool`",
    "slack_m = nan": "toy.slack_m must be finite, not nan",
    "slack_m = 1\nturns = 1.5": "toy.turns: expected `int`, got `float`",
    "slack_m = 1\nturns = -1": "toy.turns: expected `int` >= 0",
    "slack_m = 1\nradii_m = [1]": "toy.radii_m: expected a list of length 2, got 1",
    "slack_m = 1\nradii_m = [1, 'a']": r"toy.radii_m\[1\]: expected `float`, got text",
    "slack_m = 1\nside = 'third'": "toy.side is one of right, left, not 'third'",
    "slack_m = 1\nturn = 2": "toy.turn is one of 1, -1, not 2",
    "slack_m = 1\nmodes = ['a', 'c']": r"toy.modes\[1\]: invalid enum value 'c'",
    "slack_m = 1\nfile = 3": "toy.file: expected text, got 3",
    "slack_m = 1\ninner = 3": "toy.inner: expected a table, got `int`",
    "slack_m = 1\n[inner]\ndepth = 1": "toy.inner: unknown key `depth`; did you mean `depth_m`",
    "slack_m = 1\n[[rows]]\n[[rows]]\ndeep = 1": r"toy.rows\[1\]: unknown key `deep`",
}


@pytest.mark.parametrize(("text", "said"), MISTAKES.items(), ids=range(len(MISTAKES)))
def test_a_mistake_is_one_line_with_table_and_key(text, said):
    with pytest.raises(ValueError, match=f"^{said}") as refused:
        filled(Toy, parsed(text, "toy"), "toy")
    assert "\n" not in str(refused.value)
