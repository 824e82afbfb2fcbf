"""A unit file fills exactly the parameters it names and nothing is let through unread."""

import dataclasses

import pytest

from model.units import load_unit, shipped_units
from train.identification.unit_file import unit_toml


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
        ("[servos]\nstall_torq = 0.5", r"servos: unknown key `stall_torq`; did you mean `stall_torque`"),
        ("colour = 'red'", "unknown key `colour`"),
        ("name = 'x'", "named by its file"),
        ("= 3", "not TOML"),
        ("hand = 3", r"mine.toml.hand: expected a table, got `int`"),
        ("[servos]\nno_load_speed_counts = 0.0", "no-load speed"),
        ("[servos]\nvoltage = '6'", r"servos.voltage: expected `float`, got text"),
        ("[servos]\nvoltage = nan", r"servos.voltage must be finite"),
        ("[hand]\nspring_open = [1.0, inf]", "spring_open"),
        ("[hand]\ndown = [0.0, 1.0]", r"hand.down: expected a list of length 3, got 2"),
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


def test_a_unit_inherits_from_the_one_that_it_is_like(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text('like = "reference"\n[hand]\nsupply_sag = 0.5\n', encoding="utf-8")
    unit, reference = load_unit(str(path)), load_unit("reference")
    assert unit.hand == dataclasses.replace(reference.hand, supply_sag=0.5)
    assert unit.servos == reference.servos
    path.write_text('like = "nobody"\n', encoding="utf-8")
    with pytest.raises(ValueError, match=r"unknown unit 'nobody'.*reference"):
        load_unit(str(path))
