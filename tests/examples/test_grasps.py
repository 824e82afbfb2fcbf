"""The example `examples/grasps`: what must be held is held, what cannot be is not, and the table is whole."""

from dataclasses import replace

import numpy as np
import pytest
from grasps.own_hand import make_grasp
from grasps.skin import Skin
from grasps.taxonomy import GRASPS
from grasps.trial import codes_of, hold

from aero.channels import Channel
from hil.emulated.any_hand import open_target
from model.units import load_unit

NAMED = {grasp.name: grasp for grasp in GRASPS}
IDEAL = load_unit("ideal")


def test_an_easy_grasp_is_held():
    result = hold(NAMED["power sphere"], IDEAL)
    assert result.held, result.failure
    assert result.survived == 12


@pytest.mark.parametrize(
    "name", ["quadpod", *(pytest.param(name, marks=pytest.mark.slow) for name in ("sphere 3 finger", "palmar pinch"))]
)
def test_what_the_search_found_is_held_with_a_skin(name):
    result = hold(NAMED[name], IDEAL, Skin.SILICONE)
    assert result.held, result.failure


def test_the_joint_that_gives_way_is_named():
    grasp = NAMED["tip pinch"]
    result = hold(grasp, load_unit("reference"), Skin.SILICONE)
    assert result.failure.startswith("taken by ")
    assert result.gave_way.startswith("index_mcp closes by")


@pytest.mark.parametrize("change", [{"mass_kg": 20.0}, {"friction": 0.01}], ids=["too heavy", "slippery"])
def test_what_no_hand_could_hold_is_lost(change):
    grasp = NAMED["lateral"]
    result = hold(replace(grasp, thing=replace(grasp.thing, **change)), IDEAL)
    assert not result.held
    assert result.survived < 12


def test_a_finger_that_does_not_touch_is_another_grasp():
    grasp = NAMED["medium wrap"]
    without = replace(grasp, closure=(0.0, *grasp.closure[1:]))
    assert hold(without, IDEAL).failure == "not touched by index"


def test_the_table_has_33_different_grasps():
    assert [grasp.number for grasp in GRASPS] == list(range(1, 34))
    assert len(NAMED) == 33
    assert len({(grasp.thing, grasp.centre_mm, grasp.axis, grasp.closure) for grasp in GRASPS}) == 33
    for grasp in GRASPS:
        assert all(0.0 <= share <= 1.0 for share in grasp.closure), grasp.name
        assert len(grasp.closure) == len(Channel), grasp.name


def test_channels_begin_to_close_when_they_are_told_to():
    grasp = replace(NAMED["tripod"], delays_s=(0.0, 0.3, 0.0, 0.0, 0.0, 0.0, 0.1), aperture=0.2)
    moments = grasp.closing_up()
    assert [at for at, _ in moments] == [0.0, 0.1, 0.3]
    assert moments[-1][1] == grasp.closure
    assert moments[1][1][Channel.MIDDLE] == grasp.before()[Channel.MIDDLE] != grasp.closure[Channel.MIDDLE]


def test_a_guarded_hand_makes_a_grasp_and_opens():
    grasp = NAMED["lateral"]
    with open_target("emulated", guarded=True) as target:
        held = make_grasp(target, grasp, placing_s=0.5, holding_s=0.5)
        wanted = codes_of(grasp.closure, target.map).astype(float)
        # Without an object and at less torque, it comes near.
        assert np.abs(held - wanted).max() < 0.1 * 65535
        assert target.guard.phase is not None
        target.clock.sleep_until(target.clock.now() + 1.0)
        assert target.hand.read_codes().max() < 0.1 * 65535
