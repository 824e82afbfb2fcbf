"""What hangs on the shafts: one-way cables, springs, friction, end stops, couplings."""

from dataclasses import replace

import numpy as np
import pytest
from measured_hand import (
    FINGER_SPAN,
    blocked_finger,
    blocked_flexion,
    blocked_flexor,
    closing_errors,
    tension_after_impact,
)
from servo_law import COUNT, STALL, push, settle, towards

from aero.channels import CABLES, FINGERS, Channel, Joint
from model import BuiltHandParameters, BuiltHandPlant, build_built
from simulator.geometry.winding import SPOOL_RADIUS, WINDING

NOTHING = (0.0,) * 16
RIGID = BuiltHandParameters(
    spool_friction=(0.0,) * 7,
    cable_compliance=0.0,
    joint_friction=NOTHING,
    stop_compliance=0.0,
    gravity=0.0,
    contacts=False,
)
"""Springs and inertia alone."""
PULLED = list(CABLES)


@pytest.fixture
def plant() -> BuiltHandPlant:
    return BuiltHandPlant()


def wound_in(plant: BuiltHandPlant) -> np.ndarray:
    """Cable that the joints have taken up, (7,) m, from the true joint angles and the CAD radii."""
    angles = plant.joint_angles()
    return np.array([sum(r * angles[j] for j, r in WINDING.get(channel, {}).items()) for channel in Channel])


@pytest.mark.parametrize("fraction", [0.1, 0.4, 0.8])
def test_taut_cables_wind_by_the_cad_radii(fraction):
    """Without compliance and take-up, spool radius times shaft angle is what the joints take up."""
    plant = BuiltHandPlant(RIGID)
    plant.drive(Channel.THUMB_ABDUCTION, towards(0.9))
    for channel in PULLED:
        plant.drive(channel, towards(0.4 + fraction * 1.5))
    settle(plant)
    np.testing.assert_allclose(SPOOL_RADIUS * plant.angles()[PULLED], wound_in(plant)[PULLED], atol=2e-5)
    assert plant.angles()[Channel.THUMB_ABDUCTION] == plant.joint_angles()[Joint.THUMB_ABDUCTION]


def test_nothing_moves_before_the_take_up_is_wound_in():
    """48.5° of spool on one owner's index, then the MCP follows."""
    take_up = SPOOL_RADIUS * np.deg2rad(48.5)
    plant = BuiltHandPlant(replace(RIGID, cable_take_up=(take_up, *(0.0,) * 6)))
    assert plant.slack()[0] == pytest.approx(take_up)
    plant.drive(0, towards(np.deg2rad(47.0)))
    settle(plant)
    assert plant.joint_angles()[Joint.INDEX_MCP] == pytest.approx(0.0, abs=2e-3)
    assert plant.cable_tensions()[0] == 0.0
    plant.drive(0, towards(np.deg2rad(60.0)))
    settle(plant)
    assert plant.slack()[0] == 0.0
    assert plant.joint_angles()[Joint.INDEX_MCP] > 0.1


def test_cables_pull_and_do_not_push(plant):
    """A spool unwinds past the open pose without moving the finger; its cable hangs loose by as much."""
    plant.drive(0, towards(-1.0))
    settle(plant)
    assert plant.angles()[0] == pytest.approx(-1.0, abs=0.02)
    assert plant.joint_angles()[:3] == pytest.approx(np.zeros(3), abs=2e-3)
    assert plant.slack()[0] == pytest.approx(SPOOL_RADIUS * 1.0, rel=0.02)
    assert plant.cable_tensions()[0] == 0.0


def test_slack_is_that_of_the_present_in_motion():
    take_up = 0.03
    plant = BuiltHandPlant(BuiltHandParameters(cable_take_up=(take_up,) * 7))
    for channel in PULLED:
        plant.drive(channel, push(0.2))
    plant.drive(Channel.THUMB_ABDUCTION, push(0.2))
    plant.advance_to(0.0501)
    expected = (take_up + wound_in(plant) - SPOOL_RADIUS * plant.angles())[PULLED]
    assert np.all(expected > 0)
    assert plant.slack()[PULLED] == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("compliance", [2e-6, 5.4e-6, 2e-5])
def test_a_cable_stretches_by_its_compliance(compliance):
    plant = BuiltHandPlant(replace(RIGID, cable_compliance=compliance))
    plant.drive(0, push(STALL))
    settle(plant)
    stretch = SPOOL_RADIUS * plant.angles()[0] - wound_in(plant)[0]
    tension = plant.cable_tensions()[0]
    assert tension == pytest.approx(STALL / SPOOL_RADIUS, rel=1e-3)
    assert stretch / tension == pytest.approx(compliance, rel=0.02)


def test_end_stops_give_by_their_compliance():
    plant = BuiltHandPlant(replace(RIGID, stop_compliance=0.01))
    plant.drive(Channel.THUMB_ABDUCTION, push(-0.3))
    settle(plant)
    assert plant.angles()[Channel.THUMB_ABDUCTION] == pytest.approx(-0.3 * 0.01, rel=0.05)


@pytest.mark.parametrize("finger", FINGERS)
def test_fingers_stop_where_the_recorded_hand_does(finger):
    """0.976-0.979 of 288.16° with 3.0-3.4 A held there, which is about 0.33 N m."""
    assert 0.976 <= blocked_finger(finger) <= 0.979


@pytest.mark.parametrize(("abduction", "recorded"), [(0.0, 0.605), (0.5, 0.73), (0.75, 0.93), (1.0, 0.97)])
def test_abduction_moves_the_flexion_stop(abduction, recorded):
    """As recorded within a tenth of the range: blocked by the palm at first, by its own stop at last."""
    assert blocked_flexion(abduction) == pytest.approx(recorded, abs=0.1)


def test_flexor_of_a_thumb_that_is_not_abducted_meets_the_palm():
    """Recorded: blocked at 0.826 of its range; here the pads sink in by 1 mm, and at 0.875 boxes of plastic meet."""
    assert blocked_flexor() == pytest.approx(0.826, abs=0.08)


@pytest.mark.parametrize("finger", FINGERS)
def test_staged_closure(plant, finger):
    """The MCP closes first; PIP and DIP, tied together, follow when it has reached its stop."""
    mcp, pip, dip = Joint(3 * finger), Joint(3 * finger + 1), Joint(3 * finger + 2)
    stop = plant.parameters.closed_stop[mcp]
    for fraction in np.linspace(0.05, 0.95, 19):
        plant.drive(finger, towards(fraction * FINGER_SPAN))
        settle(plant, 0.5)
        angles = plant.joint_angles()
        if angles[mcp] < 0.98 * stop:
            assert angles[pip] < 0.03
        assert angles[dip] == pytest.approx(angles[pip], abs=0.02)
    assert angles[pip] > 1.2


def test_load_of_a_closing_finger_is_in_the_recorded_range():
    """Counts of error after closing moves to 5, 20, 50, 75 and 90 %, over the four fingers of the recorded hand."""
    recorded = {0.05: (4, 15), 0.2: (12, 17), 0.5: (18, 19), 0.75: (23, 26), 0.9: (23, 29)}
    for error, (fraction, (least, most)) in zip(closing_errors(tuple(recorded)), recorded.items(), strict=True):
        assert least - 5 <= error <= most + 5, fraction


@pytest.mark.parametrize("channel", PULLED)
def test_friction_holds_on_to_the_tension_of_an_impact(plant, channel):
    """A spool run into its stop at full effort stays up to its dry friction above what the motor alone holds."""
    held = STALL + plant.parameters.spool_friction[channel]
    assert STALL / SPOOL_RADIUS < tension_after_impact(channel) <= 1.001 * held / SPOOL_RADIUS


def test_friction_holds_what_it_can_hold():
    """Within its dry friction a shaft does not creep: less than a tenth of a count a second."""
    plant = BuiltHandPlant(replace(BuiltHandParameters(), cable_take_up=(0.5,) * 7))
    plant.drive(0, push(0.8 * plant.parameters.spool_friction[0]))
    settle(plant, 1.0)
    assert abs(plant.angles()[0]) < 0.1 * COUNT


def test_abduction_winds_both_thumb_cables():
    """Swinging the thumb out with the spools held pulls on both cables, 2.5 mm/rad."""
    plant = BuiltHandPlant(replace(RIGID, cable_take_up=(0.02,) * 7))
    loose = plant.slack()
    plant.drive(Channel.THUMB_ABDUCTION, towards(1.0))
    settle(plant)
    paid = plant.slack() - loose
    assert paid[Channel.THUMB_CMC_FLEXION] == pytest.approx(2.5e-3 * plant.joint_angles()[12], rel=0.05)
    assert paid[Channel.THUMB_FLEXOR] == pytest.approx(2.5e-3 * plant.joint_angles()[12], rel=0.05)


def test_left_hand_moves_as_the_right_one():
    plants = [BuiltHandPlant(side=side) for side in ("right", "left")]
    for plant in plants:
        for shaft, goal in enumerate((2.0, 1.0, 4.0, 3.0, 0.8, 0.5, 1.0)):
            plant.drive(shaft, towards(goal))
        settle(plant, 0.3)
    np.testing.assert_allclose(plants[1].joint_angles(), plants[0].joint_angles(), atol=1e-6)
    np.testing.assert_allclose(plants[1].angles(), plants[0].angles(), atol=1e-6)


def test_open_hand_touches_nothing():
    plant = BuiltHandPlant(replace(BuiltHandParameters(), gravity=0.0))
    with_contacts = plant.joint_angles()
    settle(plant, 0.2)
    np.testing.assert_allclose(plant.joint_angles(), with_contacts, atol=1e-3)


def test_compiled_model_carries_the_parameters():
    parameters = BuiltHandParameters(
        rotor_inertia=(1e-3,) * 7, spool_friction=(0.01,) * 7, joint_friction=(0.002,) * 16, timestep=0.001, gravity=3.0
    )
    model = build_built("right", parameters).compile()
    assert (model.njnt, model.ntendon, model.nu, model.neq) == (22, 6, 14, 5)
    spool = model.joint("ring_spool").dofadr[0]
    assert model.dof_armature[spool] == 1e-3
    assert model.dof_frictionloss[spool] == 0.01
    abduction = model.joint("thumb_abduction").dofadr[0]
    assert model.dof_armature[abduction] == pytest.approx(1e-3 + 2e-5)
    assert model.dof_frictionloss[abduction] == pytest.approx(0.012)
    assert model.opt.timestep == 0.001
    assert model.opt.gravity[2] * (1.0 - model.body_gravcomp[2]) == pytest.approx(-3.0)


def test_a_cable_that_is_too_short_to_exist_is_refused():
    with pytest.raises(ValueError, match="cable_take_up must be above -1 m"):
        BuiltHandParameters(cable_take_up=(0.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0))
