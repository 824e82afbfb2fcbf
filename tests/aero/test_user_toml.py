"""TOML that people bring ends in one line, soon, whatever is in it."""

import time
import tomllib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aero.user_toml import MOST_PARTS, parse_toml


@pytest.mark.parametrize(
    "text",
    [
        pytest.param(".".join("a" * 20_000) + " = 1", id="dotted"),
        pytest.param("[" + ".".join("a" * 20_000) + "]", id="table"),
        pytest.param(" . ".join(['"a b"'] * 20_000) + " = 1", id="quoted"),
        pytest.param("x = {" + ".".join("a" * 20_000) + " = 1}", id="inline"),
        pytest.param("x = " + "[" * 20_000 + "]" * 20_000, id="arrays"),
        pytest.param("x = " + "{a = " * 20_000 + "1" + "}" * 20_000, id="tables"),
    ],
)
def test_what_would_take_minutes_or_the_whole_stack_is_refused(text):
    begun = time.monotonic()
    with pytest.raises(ValueError, match=r"parts|nested|Invalid|Expected") as found:
        parse_toml(text)
    assert "\n" not in str(found.value)
    assert time.monotonic() - begun < 5.0


@given(st.text(alphabet="ab-_.\"' =[]{}1,\n#", max_size=200))
def test_everything_else_is_what_the_library_makes_of_it(text):
    try:
        expected = tomllib.loads(text)
    except tomllib.TOMLDecodeError:
        with pytest.raises(ValueError, match=r"\S"):
            parse_toml(text)
    else:
        assert text.count(".") >= MOST_PARTS or parse_toml(text) == expected


def test_long_text_and_long_lists_are_no_keys():
    text = 'x = "' + "a" * 300_000 + '"\ny = [' + ", ".join(["0.5"] * 5_000) + "]\n"
    assert len(parse_toml(text)["y"]) == 5_000
