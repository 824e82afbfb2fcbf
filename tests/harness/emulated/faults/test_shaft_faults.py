"""What stands between servos and shafts, on a bench of seven bare shafts: one channel is changed, and only that one."""

from dataclasses import replace

import numpy as np
import pytest

from aero import Channel
from firmware_emulator.bench import Bench
from firmware_emulator.plant import Drive
from hil.emulated.any_hand import open_target
from hil.emulated.faults import Schedule, parse_fault
from hil.emulated.faults.assembly import HandAssembly
from hil.emulated.faults.encoder import Encoder
from model.units import load_unit

UNIT = load_unit("ideal")
GOALS = (0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.1)
RING = Channel.RING


def driven(text, seconds=1.0):
    """Drive a bench to GOALS through a fault; return bench and fault."""
    fault, bench, chances = parse_fault(text), Bench(), Schedule((), 1)
    assembly = HandAssembly(UNIT, firmware="0.2.0", side="right", random=chances.random, fire=chances.fire)
    assembly.build_mechanics(bench, None)
    fault.fault.inject(assembly, fault).begin()
    shafts = assembly.shafts
    for shaft, goal in enumerate(GOALS):
        shafts.drive(shaft, Drive(setpoint=goal, stiffness=3.0, damping=0.05, limit=0.5))
    for tick in range(1, round(seconds / 0.002) + 1):
        shafts.advance_to(tick * 0.002)
    return bench, shafts


@pytest.mark.parametrize(
    ("text", "angle"),
    [
        ("encoder_scale:ring=1.25", 0.7 / 1.25),
        ("encoder_offset:ring=100", 0.7 - 100 * 2 * np.pi / 4096),
        ("winding_reversed:ring", -0.7),
        ("motor_dead:ring", 0.0),
        ("encoder_quantised:ring=64", 0.7),
        ("encoder_play:ring=40", 0.7 + 20 * 2 * np.pi / 4096),
    ],
)
def test_the_servo_goes_by_what_it_reads(text, angle):
    """The shaft stands where the wrong reading is the goal; the six others where they were sent."""
    bench, shafts = driven(text)
    others = [channel for channel in Channel if channel is not RING]
    assert bench.angles()[RING] == pytest.approx(angle, abs=0.05)
    np.testing.assert_allclose(bench.angles()[others], np.array(GOALS)[others], atol=0.02)
    np.testing.assert_allclose(shafts.angles()[others], bench.angles()[others])
    if "motor" not in text:
        assert shafts.angles()[RING] == pytest.approx(0.7, abs=0.1)


def test_a_frozen_encoder_lets_the_shaft_run():
    bench, shafts = driven("encoder_frozen:ring")
    assert bench.angles()[RING] > 3.0
    assert (shafts.angles()[RING], shafts.speeds()[RING]) == (0.0, 0.0)


def test_a_scaled_encoder_scales_speeds():
    bench, shafts = driven("encoder_scale:ring=2", seconds=0.05)
    assert shafts.speeds()[RING] == pytest.approx(2 * bench.speeds()[RING])


def test_a_weak_motor_says_what_it_would_give():
    bench, shafts = driven("motor_weak:ring=0.5", seconds=0.02)
    assert shafts.efforts()[RING] == pytest.approx(2 * bench.efforts()[RING])


def test_exchanged_cables_turn_each_others_shafts():
    bench, shafts = driven("thumb_cables_swapped")
    np.testing.assert_allclose(bench.angles()[5:], [1.1, 1.0], atol=0.02)
    np.testing.assert_allclose(shafts.angles(), GOALS, atol=0.02)


def test_answers_of_one_servo_are_spoiled_and_no_others():
    def reported(*faults):
        with open_target(seed=3, faults=faults) as target:
            target.hand.command_codes([30000] * 7)
            target.clock.sleep_until(target.clock.now() + 0.5)
            return target.hand.read_codes().astype(int)

    differ = reported(parse_fault("position_coarse:ring=1024")) - reported()
    assert np.flatnonzero(differ).tolist() == [RING]


class Told(Bench):
    """A bench that keeps the last drive of each shaft."""

    def __init__(self):
        super().__init__()
        self.told = {}

    def drive(self, shaft, drive):
        self.told[shaft] = drive
        super().drive(shaft, drive)


DRIVE = Drive(setpoint=0.7, stiffness=3.0, damping=0.05, limit=0.5)


@pytest.mark.parametrize("active", [False, True])
def test_the_state_behind_a_fault_without_effect_is_that_of_the_shafts_field_by_field(active):
    bench = Bench()
    fault = Encoder(bench, RING, lambda true, seconds: true)
    if active:
        fault.begin()
    fault.drive(RING, DRIVE)
    for tick in range(1, 60):
        fault.advance_to(tick * 0.002)
    assert bench.speeds()[RING] > 0.1
    assert fault.state() == bench.state()


@pytest.mark.parametrize("angle", [0.3, 0.7])
def test_a_frozen_encoder_reads_what_it_read_when_it_froze(angle):
    frozen, chances = parse_fault("encoder_frozen:ring"), Schedule((), 1)
    assembly = HandAssembly(UNIT, firmware="0.2.0", side="right", random=chances.random, fire=chances.fire)
    assembly.build_mechanics(Bench(), None)
    fault = frozen.fault.inject(assembly, frozen)
    shafts = assembly.shafts
    shafts.drive(RING, replace(DRIVE, setpoint=angle))
    for tick in range(1, 500):
        shafts.advance_to(tick * 0.002)
    read = shafts.angles()[RING]
    fault.begin()
    shafts.drive(RING, replace(DRIVE, setpoint=0.0))
    for tick in range(500, 700):
        shafts.advance_to(tick * 0.002)
    assert read == pytest.approx(angle, abs=0.02)
    assert shafts.angles()[RING] == read


def test_a_fault_that_begins_changes_the_drive_at_once():
    bench = Told()
    fault = Encoder(bench, RING, lambda true, seconds: true + 0.1)
    fault.drive(RING, DRIVE)
    fault.begin()
    assert bench.told[RING] == fault.changed(DRIVE)
    assert bench.told[RING].setpoint == pytest.approx(0.6)
