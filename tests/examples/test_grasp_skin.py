"""The silicone on a built hand: none on plastic, on the links that the paper names, and as soft as asked."""

import pytest
from grasps.skin import COVERED, NUMBERS, Skin, lay_skin

from model.built import build_built


def covered_with(skin):
    spec = build_built("right")
    lay_skin(spec, skin, 0.002)
    return spec


def test_a_hand_of_hard_plastic_is_the_hand_without_a_skin_to_the_byte():
    assert covered_with(Skin.PLASTIC).to_xml() == build_built("right").to_xml()


def test_the_skin_is_on_fingertips_middle_links_and_palm():
    plain, covered = covered_with(Skin.PLASTIC).compile(), covered_with(Skin.SILICONE).compile()
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


@pytest.mark.parametrize("number", NUMBERS, ids=lambda number: number.name)
def test_the_middle_lies_between_the_ends(number):
    assert number.least < number.middle < number.most
