"""Conditions stay within their ranges, and change of a unit what they say and nothing else."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from model import BuiltHandParameters
from model.built import build_built
from model.units import load_unit
from model.units.conditions import CONDITIONS, Conditions, drawn

SEEDS = st.integers(0, 2**31)
REFERENCE = load_unit("reference")


@given(SEEDS)
def test_conditions_are_drawn_within_their_ranges(seed):
    found = drawn(seed)
    assert np.linalg.norm(found.down) == pytest.approx(1.0)
    assert 10.0 <= found.room_c <= 30.0
    assert 0.0 <= found.work <= 1.0
    assert 0.9 <= found.supply_ratio <= 1.1
    assert 0.0 <= found.late_s <= 0.010
    assert 300 <= found.torque <= 1023
    assert 100 <= found.speed <= 32766
    assert np.all(np.abs(found.pretension_m) <= 1e-4)
    servos = found.applied(REFERENCE).servos
    assert 10.0 <= servos.start_temperature_c <= 45.0


@given(SEEDS, st.sets(st.sampled_from(CONDITIONS)))
def test_a_kind_is_drawn_alike_alone_and_with_others(seed, kinds):
    together, some, nothing = drawn(seed), drawn(seed, kinds), Conditions()
    fields = {
        "gravity": ("tilt_rad", "heading_rad"),
        "temperature": ("room_c", "work"),
        "supply": ("supply_ratio",),
        "lateness": ("late_s",),
        "settings": ("torque", "speed"),
        "tension": ("pretension_m",),
    }
    assert fields.keys() == set(CONDITIONS)
    for kind, names in fields.items():
        source = together if kind in kinds else nothing
        assert [getattr(some, name) for name in names] == [getattr(source, name) for name in names]


def test_hands_lie_in_every_direction_and_about_half_have_the_palm_down():
    heights = [drawn(seed).down[2] for seed in range(200)]
    assert 80 < sum(height > 0 for height in heights) < 120
    assert max(heights) > 0.99
    assert min(heights) < -0.99


def test_a_cold_motor_is_stronger_and_its_gears_rub_more():
    """16 K below the unit's 36 °C, in the middle of start and rest: 1 / (1 - 0.0039 * 16) and exp(0.16)."""
    servos = dataclasses.replace(REFERENCE.servos, start_temperature_c=34.0, rest_temperature_c=38.0)
    cold = Conditions(room_c=12.5, work=0.0).applied(dataclasses.replace(REFERENCE, servos=servos))
    assert (cold.servos.start_temperature_c, cold.servos.rest_temperature_c) == (12.5, 27.5)
    assert cold.servos.stall_torque / REFERENCE.servos.stall_torque == pytest.approx(1.0666, abs=1e-4)
    assert cold.hand.spool_friction[0] / REFERENCE.hand.spool_friction[0] == pytest.approx(1.1735, abs=1e-4)
    assert cold.hand.back_emf == cold.servos.back_emf


def test_gravity_acts_where_it_is_said_to():
    turned = dataclasses.replace(REFERENCE.hand, down=(0.0, 0.6, 0.8))
    np.testing.assert_allclose(build_built("right", turned).option.gravity, (0.0, 5.886, 7.848))
    np.testing.assert_allclose(build_built("right", REFERENCE.hand).option.gravity, (0.0, 0.0, -9.81))
    with pytest.raises(ValueError, match="length 1"):
        BuiltHandParameters(down=(0.0, 0.0, 2.0))


def test_a_tighter_day_shortens_every_cable():
    tighter = Conditions(pretension_m=(1e-4,) * 7).applied(REFERENCE).hand.cable_take_up
    np.testing.assert_allclose(np.subtract(REFERENCE.hand.cable_take_up, tighter), 1e-4)
