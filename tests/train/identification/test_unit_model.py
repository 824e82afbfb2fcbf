import dataclasses
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from aero.channels import FINGERS, Channel
from model.units import load_unit
from model.units.plausible import plausible_unit
from train.identification.trace import Trace, window_counts
from train.identification.unit_file import unit_toml
from train.identification.unit_parameters import FREE, apply, felt_otherwise, identifiable_parameters


def numbers(unit):
    values = {
        f"{section}.{field.name}": getattr(getattr(unit, section), field.name)
        for section in ("hand", "servos")
        for field in dataclasses.fields(getattr(unit, section))
    }
    return {name: value for name, value in values.items() if not isinstance(value, str)}


# A unit file is rounded; what follows from its numbers is not.
REFERENCE = apply(load_unit("reference"), (), np.zeros(0))


@pytest.mark.parametrize("row", range(len(FREE)))
def test_a_number_moves_its_own_field_and_what_follows_from_it(row):
    unit = REFERENCE
    x = np.zeros(len(FREE))
    x[row] = 0.5 * FREE[row].spread
    before, after = numbers(unit), numbers(apply(unit, FREE, x))
    changed = {name for name in before if not np.allclose(before[name], after[name], rtol=1e-12)}
    own = FREE[row].name.replace("rise", "closed")
    follows = {"servos.no_load_speed_counts": {"hand.back_emf"}, "hand.spring_open": {"hand.spring_closed"}}
    assert changed <= {own} | follows.get(own, set()) | {"servos.stall_torque"}
    assert own in changed


@given(st.integers(0, 10_000))
@settings(max_examples=20, deadline=None)
def test_a_written_unit_reads_back(tmp_path_factory, seed):
    unit = plausible_unit(seed)
    path = tmp_path_factory.mktemp("unit") / "twin.toml"
    path.write_text(unit_toml(unit, 'A "hand" of µm', {}), encoding="utf-8")
    back = load_unit(str(path))
    assert back.description == 'A "hand" of µm'
    for name, value in numbers(back).items():
        assert np.allclose(value, numbers(unit)[name], rtol=1e-4, atol=1e-12), name


@given(st.sets(st.sampled_from(Channel)))
def test_what_is_fitted_to_some_channels_changes_no_other(moved):
    told = identifiable_parameters(FREE, moved, {})
    assert all(set(number.channels) <= moved for number in told)
    unit = apply(REFERENCE, told, np.full(len(told), 0.1))
    if len(moved) < len(Channel):
        assert unit.servos == REFERENCE.servos
    for channel in set(Channel) - moved:
        for field in ("rotor_inertia", "cable_friction", "spool_friction", "cable_take_up"):
            assert getattr(unit.hand, field)[channel] == getattr(REFERENCE.hand, field)[channel]
        if channel in FINGERS:
            own = slice(3 * channel, 3 * channel + 3)
            assert unit.hand.closed_stop[own] == REFERENCE.hand.closed_stop[own]
            assert unit.hand.spring_open[own] == REFERENCE.hand.spring_open[own]
    if len(moved) == len(Channel):
        assert told == FREE


def test_a_still_channel_tells_the_tension_of_its_cable_alone():
    told = identifiable_parameters(FREE, {Channel.INDEX}, {"hand.cable_take_up": {Channel.RING, Channel.INDEX}})
    assert [n.name for n in told if Channel.RING in n.channels] == ["hand.cable_take_up"]
    assert {n.name for n in told if Channel.INDEX in n.channels} > {"hand.cable_take_up", "hand.spool_friction"}


@pytest.mark.parametrize(("share", "stopped"), [(0.85, set()), (0.95, {Channel.RING, Channel.PINKY})])
def test_only_a_finger_that_closes_far_tells_its_stop(share, stopped):
    codes = np.zeros((50, 7), np.int64)
    codes[20:, [Channel.RING, Channel.PINKY, Channel.THUMB_FLEXOR]] = round(share * 65535)
    times, blank = np.arange(50) * 0.02, np.zeros((50, 7))
    trace = Trace("a", times, codes, times, blank, blank, blank, window_counts("right"))
    otherwise = felt_otherwise([trace])
    assert otherwise["hand.closed_stop"] == stopped
    told = identifiable_parameters(FREE, set(Channel), otherwise)
    assert [n.channels for n in told if n.name == "hand.closed_stop"] == ([tuple(sorted(stopped))] if stopped else [])


def test_a_written_unit_says_what_was_fitted_how_surely_and_what_the_recordings_do_not_tell():
    unit = plausible_unit(1)
    friction = np.array(unit.hand.spool_friction)
    low, high = friction * 0.9, friction * 1.1
    low[3:] = high[3:] = friction[3:]
    told = {"hand.spool_friction": np.arange(7) != 2}
    lines = unit_toml(unit, "", {"hand.spool_friction": (low, high)}, told).splitlines()
    above = {line.split(" = ")[0]: before for before, line in pairwise(lines)}
    assert above["spool_friction"].startswith(f"# N m; fitted, 95 % interval of each: {low[0]:.3g} to {high[0]:.3g}; ")
    assert f"{high[2]:.3g} (not determined by the recordings); as the starting unit" in above["spool_friction"]
    assert above["spool_friction"].endswith("; as the starting unit" * 4)
    assert "\n".join(lines).count("(not determined by the recordings)") == 1
    assert above["rotor_inertia"] == "# kg m²; as the starting unit"
