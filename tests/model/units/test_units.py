"""A unit file fills exactly the parameters it names and nothing is let through unread."""

import dataclasses
from dataclasses import dataclass

import pytest
from hypothesis import given
from hypothesis import strategies as st

from model.units import fill, load_unit, shipped_units
from train.identification.unit_file import unit_toml


@dataclass(frozen=True)
class Inner:
    depth_m: float = 1.0


@dataclass(frozen=True)
class Toy:
    slack_m: float = 0.5
    turns: int = 3
    stretchy: bool = True
    radii_m: tuple[float, float] = (1.0, 2.0)
    inner: Inner = Inner()


@given(st.floats(-9, 9), st.integers(), st.booleans(), st.lists(st.floats(-9, 9), min_size=2, max_size=2))
def test_every_key_lands_in_its_field(slack, turns, stretchy, radii):
    table = {"slack_m": slack, "turns": turns, "stretchy": stretchy, "radii_m": radii, "inner": {"depth_m": slack}}
    assert fill(Toy, table, "toy") == Toy(slack, turns, stretchy, tuple(radii), Inner(slack))


@pytest.mark.parametrize("name", shipped_units())
def test_the_shipped_units_load(name):
    unit = load_unit(name)
    assert unit.name == name
    assert unit.description


def test_a_users_file_is_read_by_path(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text('description = "mine"\n[servos]\nstall_torque = 0.5\n')
    unit = load_unit(str(path))
    assert (unit.name, unit.servos.stall_torque) == (str(path), 0.5)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[servos]\nstall_torq = 0.5", "unknown stall_torq"),
        ("colour = 'red'", "unknown colour"),
        ("name = 'x'", "named by its file"),
        ("= 3", "no TOML"),
        ("hand = 3", "hand"),
        ("[servos]\nno_load_speed_counts = 0.0", "no-load speed"),
    ],
)
def test_a_mistake_in_a_users_file_is_named(tmp_path, text, message):
    path = tmp_path / "mine.toml"
    path.write_text(text)
    with pytest.raises(ValueError, match=message):
        load_unit(str(path))


def test_back_emf_has_one_home(tmp_path):
    path = tmp_path / "hand.toml"
    path.write_text("[servos]\nno_load_speed_counts = 9000.0\n", encoding="utf-8")
    unit = load_unit(str(path))
    assert unit.hand.back_emf == unit.servos.back_emf != load_unit("ideal").hand.back_emf
    path.write_text("[hand]\nback_emf = 0.05\n", encoding="utf-8")
    with pytest.raises(ValueError, match="follows from"):
        load_unit(str(path))


def test_an_unfinished_fit_is_taken_only_when_it_is_asked_for(tmp_path):
    path = tmp_path / "mine.unfinished.toml"
    path.write_text(unit_toml(dataclasses.replace(load_unit("reference"), unfinished=True), "stopped", {}))
    with pytest.raises(ValueError, match=r"is an unfinished fit.*unfinished:"):
        load_unit(str(path))
    asked = load_unit(f"unfinished:{path}")
    assert (asked.name, asked.unfinished) == (f"unfinished:{path}", True)
    assert asked.hand == load_unit("reference").hand


def test_a_byte_order_mark_is_no_part_of_a_unit(tmp_path):
    path = tmp_path / "windows.toml"
    path.write_bytes(b"\xef\xbb\xbf" + unit_toml(load_unit("reference"), "", {}).encode())
    assert load_unit(str(path)).hand == load_unit("reference").hand
