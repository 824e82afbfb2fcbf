import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from aero import AeroHand
from aero.channels import CABLES, FINGERS, Channel, Joint
from firmware_emulator.links.in_process import InProcessLink
from hil.emulated.emulated_hand import build_emulated
from hil.emulated.emulated_spec import EmulatedSpec
from model.units import load_unit
from model.units.plausible import (
    ACCELERATION_UNIT_COUNTS,
    CMC_STOP_RAD,
    PADS,
    RANGES,
    START_C,
    TAKE_UP_M,
    THENAR_M,
    plausible_unit,
)

THUMB_CABLES = (Channel.THUMB_CMC_FLEXION, Channel.THUMB_FLEXOR)
seeds = st.integers(0, 2**32 - 1)


@given(seeds)
@settings(deadline=None)
def test_stays_in_its_ranges(seed):
    unit, reference = plausible_unit(seed), load_unit("reference")
    for span, name in ((each, name) for each in (*RANGES, *PADS) for name in each.field.split("+")):
        section, field = name.split(".")
        drawn, origin = (np.array(getattr(getattr(u, section), field)) for u in (unit, reference))
        if field == "closed_stop":
            assert CMC_STOP_RAD[0] <= drawn[Joint.THUMB_CMC] <= CMC_STOP_RAD[1]
            drawn[Joint.THUMB_CMC] = origin[Joint.THUMB_CMC]
        assert np.all(drawn <= origin * span.factor * (1 + 1e-12))
        assert np.all(drawn >= origin / span.factor * (1 - 1e-12))
    lengths = np.array(unit.hand.cable_take_up)
    lengths[list(THUMB_CABLES)] -= np.array(reference.hand.cable_take_up)[list(THUMB_CABLES)]
    assert np.all(lengths[list(CABLES)] >= TAKE_UP_M[0] - 1e-12)
    assert np.all(lengths[list(CABLES)] <= TAKE_UP_M[-1] + 1e-12)
    assert ACCELERATION_UNIT_COUNTS[0] <= unit.servos.acceleration_unit_counts <= ACCELERATION_UNIT_COUNTS[1]
    assert THENAR_M[0] <= unit.hand.thenar_radius <= THENAR_M[1]
    assert START_C[0] <= unit.servos.start_temperature_c <= START_C[1]


def test_about_half_of_the_fingers_are_taut_at_the_open_hand():
    taut = [take_up < 0.0 for seed in range(50) for take_up in plausible_unit(seed).hand.cable_take_up[:4]]
    assert 80 <= sum(taut) <= 120


def test_thumbs_differ_as_widely_as_fingers():
    lengths = np.array([plausible_unit(seed).hand.cable_take_up for seed in range(50)])
    for cable in THUMB_CABLES:
        assert lengths[:, cable].std() > 0.7 * lengths[:, list(FINGERS)].std(axis=0).mean()


def test_same_seed_same_unit():
    assert plausible_unit(7) == plausible_unit(7) != plausible_unit(8)


@given(seeds, st.lists(st.lists(st.integers(0, 65535), min_size=7, max_size=7), min_size=1, max_size=3))
@settings(max_examples=8, deadline=None)
def test_every_plausible_hand_obeys_any_commands_and_opens(seed, commands):
    electronics, workbench = build_emulated(plausible_unit(seed), EmulatedSpec(seed=seed))
    clock = electronics.clock
    with AeroHand(InProcessLink(electronics), clock) as hand:
        for codes in commands:
            hand.command_codes(codes)
            clock.sleep_until(clock.now() + 0.3)
        assert np.isfinite(workbench.mechanics.joint_angles()).all()
        assert np.all(workbench.mechanics.cable_tensions() >= 0.0)
        assert np.all(np.abs(hand.read_currents()) <= 700 * 6.5e-3)
        hand.command_codes([0] * 7)
        clock.sleep_until(clock.now() + 1.5)
        assert np.all(hand.read_codes() < 0.06 * 65535)
