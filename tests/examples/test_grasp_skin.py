"""The silicone on a built hand: nothing by default, on the links that the paper names, and as soft as asked."""

import dataclasses

import mujoco
import numpy as np
import pytest
from grasps.skin import NUMBERS, Skin, with_skin

from aero.channels import Joint
from model.built import build_built
from model.parameters import BuiltHandParameters
from model.softness import COVERED
from model.units import load_unit

PRESS_N = 3.0
LOAD_KG = 10.0


def compiled(parameters):
    return build_built("right", parameters).compile()


def test_no_unit_has_a_skin_by_itself():
    for name in ("ideal", "reference", "paper"):
        hand = load_unit(name).hand
        assert [getattr(hand, number.field) for number in NUMBERS] == [0.0] * 4


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


@pytest.mark.parametrize("link", ["index_distal", "ring_distal", "thumb_distal"])
@pytest.mark.parametrize("compliance", [0.1e-3, 0.3e-3, 0.6e-3])
def test_a_heavy_thing_sinks_in_by_the_compliance(link, compliance):
    skin = dataclasses.replace(with_skin(load_unit("ideal"), Skin.SILICONE).hand, skin_compliance=compliance)
    spec = build_built("right", skin)
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    probe = spec.compile()
    data = mujoco.MjData(probe)
    mujoco.mj_forward(probe, data)
    box = data.geom(f"{link}_box0")
    radius = 0.02
    body = spec.worldbody.add_body(name="load", pos=np.add(box.xpos, (0.0, 0.0, 0.05)))
    body.add_joint(type=mujoco.mjtJoint.mjJNT_SLIDE, axis=(0.0, 0.0, 1.0))
    body.add_geom(name="load", size=(radius, 0.0, 0.0), mass=LOAD_KG)
    model = spec.compile()
    data = mujoco.MjData(model)
    # The hand stands still, so that only the skin gives.
    model.dof_damping[[model.joint(joint.label).dofadr[0] for joint in Joint]] = 1e6
    data.body("load").xfrc_applied[2] = -PRESS_N
    for _ in range(3000):
        mujoco.mj_step(model, data)
    (depth,) = (-contact.dist for contact in data.contact if model.geom("load").id in contact.geom)
    assert depth == pytest.approx(PRESS_N * compliance, rel=0.1)
