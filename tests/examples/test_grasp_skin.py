"""The silicone on a built hand: nothing by default, on the links that the paper names, and as soft as asked."""

import pytest
from grasps.skin import NUMBERS, Skin, with_skin

from model.built import build_built
from model.parameters import BuiltHandParameters
from model.softness import COVERED
from model.units import load_unit


def compiled(parameters):
    return build_built("right", parameters).compile()


def test_a_hand_of_hard_plastic_is_the_hand_without_a_skin_to_the_byte():
    plain = build_built("right", BuiltHandParameters()).to_xml()
    unused = BuiltHandParameters(skin_twist=0.001, skin_roll=0.001, skin_compliance=0.001)
    assert build_built("right", unused).to_xml() == plain
    unit = load_unit("reference")
    assert with_skin(with_skin(unit, Skin.MOST), Skin.PLASTIC) == unit


def test_the_skin_is_on_fingertips_middle_links_and_palm():
    plain, covered = compiled(BuiltHandParameters()), compiled(with_skin(load_unit("ideal"), Skin.SILICONE).hand)
    changed = {
        covered.body(covered.geom_bodyid[geom]).name
        for geom in range(covered.ngeom)
        if covered.geom_friction[geom].tolist() != plain.geom_friction[geom].tolist()
    }
    assert changed == set(COVERED)
    tip = covered.geom("ring_distal_box0")
    # Middle of the ranges in examples/grasps/skin.py.
    assert tip.friction.tolist() == pytest.approx([1.0, 0.0016, 0.00015])
    assert (tip.condim.item(), tip.priority.item()) == (6, 1)


@pytest.mark.parametrize("number", NUMBERS, ids=lambda number: number.field)
def test_the_middle_lies_between_the_ends(number):
    assert number.least < number.middle < number.most
