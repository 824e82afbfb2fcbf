"""Surfaces for the grasps: pads from the ranges, or none."""

import pytest
from grasps.skin import NUMBERS, Skin, with_skin

from model import BuiltHandParameters


def test_a_skin_sets_the_pads_and_plastic_has_none():
    assert with_skin(BuiltHandParameters(), Skin.PLASTIC).pad_friction == 0.0
    assert with_skin(BuiltHandParameters(), Skin.SILICONE).pad_friction == 1.0


@pytest.mark.parametrize("number", NUMBERS, ids=lambda number: number.field)
def test_the_middle_lies_between_the_ends(number):
    assert number.least < number.middle < number.most
