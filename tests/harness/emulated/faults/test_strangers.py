"""Faults outside the catalogue change what a driver reads, and are gone with their part."""

from contextlib import suppress

import pytest
from figures.strangers import FIVE, drawn_physics
from figures.strangers.physics import PARAMETERS
from hypothesis import given
from hypothesis import strategies as st

from aero.errors import AeroError
from hil.emulated.any_hand import open_target

CLOSED = (64000, 62000, 60000, 58000, 45000, 48000, 45000)


def one_of_each():
    """Return the first drawn fault of each parameter."""
    found = {}
    for seed in range(400):
        fault = drawn_physics(seed)
        found.setdefault(fault.fault.words, fault)
    return list(found.values())


def move(target):
    for code in (0, 1, 0):
        target.hand.command_codes([code * one for one in CLOSED])
        target.clock.sleep_until(target.clock.now() + 0.4)
        target.hand.read_codes()
        target.hand.read_currents()


@given(st.integers(0, 2**31))
def test_physics_are_drawn_by_their_seed_alone(seed):
    one, same = drawn_physics(seed), drawn_physics(seed)
    assert (str(one), one.part, one.channel) == (str(same), same.part, same.channel)
    assert one.fault.severity.steps[0] <= one.severity <= one.fault.severity.steps[-1]


def test_every_parameter_is_drawn():
    assert {fault.fault.words for fault in one_of_each()} == {one.words for one in PARAMETERS}


@pytest.mark.parametrize("fault", [*one_of_each(), *FIVE], ids=lambda fault: fault.name)
def test_a_fault_is_gone_with_its_part(fault):
    with open_target(seed=3) as target:
        target.inject(fault)
        assert target.wrong == (fault,)
        with suppress(AeroError):
            move(target)
        where = "" if fault.channel is None else f" {fault.channel.label}"
        target.act(f"replace {fault.part.name.lower()}{where}")
        assert target.wrong == ()
