"""Silicone pads of a built hand: on the links that the paper names, as soft as asked, and none on plastic."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from model import BuiltHandParameters, build_built
from model.pads import PADDED
from model.units.plausible import plausible_unit
from simulator.scene import add_cube

PADS = BuiltHandParameters(pad_friction=1.0)
PLASTIC = replace(PADS, pad_friction=0.0)


def contacts_of(parameters):
    """Return friction, dimension and priority of the colliding boxes by link."""
    model = build_built("right", parameters).compile()
    solid = np.flatnonzero(model.geom_contype)
    return {
        (model.body(model.geom_bodyid[geom]).name, geom): (
            *model.geom_friction[geom].tolist(),
            int(model.geom_condim[geom]),
            int(model.geom_priority[geom]),
        )
        for geom in solid
    }


def test_pads_are_on_fingertips_middle_links_and_palm():
    padded, plastic = contacts_of(PADS), contacts_of(PLASTIC)
    assert {link for link, geom in padded if padded[link, geom] != plastic[link, geom]} == set(PADDED)
    # 3 pi / 16 of friction and radius; 3 / 16 of radius and loss.
    for (link, _), contact in padded.items():
        if link in PADDED:
            assert contact == pytest.approx((1.0, 1.59e-3, 0.152e-3, 6, 1), rel=1e-2)


def test_a_cube_on_pads_has_the_friction_of_the_pads_and_on_plastic_its_own():
    found = {}
    for parameters in (PADS, PLASTIC):
        spec = build_built("right", parameters)
        add_cube(spec)
        model = spec.compile()
        data = mujoco.MjData(model)
        cube, found[parameters] = model.geom("cube").id, set()
        for _ in range(100):  # falls onto the open hand
            mujoco.mj_step(model, data, 5)
            found[parameters] |= {
                (float(contact.friction[0]), int(contact.dim))
                for contact in data.contact
                if cube in (contact.geom1, contact.geom2)
            }
    assert (1.0, 6) in found[PADS]
    assert found[PLASTIC] == {(0.3, 3)}


def test_healthy_hands_differ_in_their_pads_and_in_nothing_else_by_them():
    frictions = [plausible_unit(seed).hand.pad_friction for seed in range(40)]
    assert min(frictions) == pytest.approx(0.52, abs=0.04)
    assert max(frictions) == pytest.approx(0.97, abs=0.04)
