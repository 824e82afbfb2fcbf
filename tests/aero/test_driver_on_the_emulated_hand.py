"""Driver and map against the emulated electronics on a bench, which encode wire and windows on their own."""

import logging

import numpy as np
import pytest

from aero import ActuationMap, AeroHand, Channel, CommandWindow
from aero.channels import FINGERS
from aero.errors import RefusedError
from aero.firmware import FIRMWARE
from aero.protocol import Opcode
from firmware_emulator.bench import Bench, BenchShaft
from firmware_emulator.hand import EmulatedHand
from firmware_emulator.links.in_process import InProcessLink
from model.units import load_unit

# Reachable in every window, degrees of shaft.
ANGLES_DEG = np.array([30.0, 90.0, 150.0, 250.0, 60.0, 40.0, 100.0])
# Static error of the servos, and the flexor's window of 2980 counts for 2986.
TOLERANCE_DEG = 1.5


class Rig:
    """A driver, the emulated hand it drives, and the truth about the shafts."""

    def __init__(self, plant=None, **options):
        self.plant = plant or Bench()
        self.electronics = EmulatedHand(self.plant, **options)
        self.hand = AeroHand(InProcessLink(self.electronics), self.electronics.clock)

    def shafts_deg_after(self, codes):
        clock = self.electronics.clock
        self.hand.command_codes(codes)
        clock.sleep_until(clock.now() + 3.0)
        return np.rad2deg(self.plant.angles())


@pytest.mark.parametrize("side", ["right", "left"])
@pytest.mark.parametrize("firmware", FIRMWARE)
def test_a_posture_is_where_the_map_says_on_every_firmware(firmware, side):
    rig = Rig(firmware=firmware, side=side)
    codec = ActuationMap.for_firmware(firmware, side=side)
    shafts = rig.shafts_deg_after(codec.codes_from_angles(np.deg2rad(ANGLES_DEG)))
    np.testing.assert_allclose(shafts, ANGLES_DEG, atol=TOLERANCE_DEG)
    np.testing.assert_allclose(np.rad2deg(codec.angles_from_codes(rig.hand.read_codes())), shafts, atol=0.7)


def rise_ms(rig, channel):
    """Return the 10-90 % time of a step of 5 % of the channel's window, ms, from the shaft itself."""
    clock, codes = rig.electronics.clock, np.full(7, 20000)
    rig.shafts_deg_after(codes)
    codes[channel] += round(0.05 * 65535)
    rig.hand.command_codes(codes)
    sent, trace = clock.now(), []
    for ms in range(400):
        clock.sleep_until(sent + 1e-3 * ms)
        rig.electronics.advance_plant()
        trace.append(rig.plant.angles()[channel])
    part = (np.array(trace) - trace[0]) / (trace[-1] - trace[0])
    return int(np.argmax(part >= 0.9)) - int(np.argmax(part >= 0.1))


@pytest.mark.parametrize("channel", FINGERS, ids=lambda channel: channel.label)
def test_the_papers_servo_behind_its_firmwares_profile_rises_as_in_the_paper(channel):
    """120 ms on every finger, hardware column of table "validation"; acceleration x0.7 makes it 140 ms."""
    rig = Rig(firmware="pre", servos=load_unit("paper").servos)
    assert rise_ms(rig, channel) == pytest.approx(120, abs=8)


def test_the_papers_servo_is_slower_on_longer_ways_by_the_root_of_the_step():
    """Table "validation": 120 ms on a finger, and 100 ms on the shorter flexor; without a profile both are faster."""
    unit = load_unit("paper").servos
    flexor = rise_ms(Rig(firmware="pre", servos=unit), Channel.THUMB_FLEXOR)
    assert flexor == pytest.approx(100, abs=15)
    assert rise_ms(Rig(firmware="0.2.0", servos=unit), Channel.INDEX) < 70


@pytest.mark.parametrize("firmware", FIRMWARE)
def test_only_the_firmware_before_limits_does_not_know_them_and_asking_changes_nothing(firmware):
    rig = Rig(firmware=firmware)
    before = rig.hand.read_codes()
    assert rig.hand.knows(Opcode.SET_TOR) == (firmware != "pre")
    np.testing.assert_array_equal(rig.hand.read_codes(), before)


@pytest.mark.parametrize("side", ["right", "left"])
@pytest.mark.parametrize("firmware", FIRMWARE)
def test_one_harmless_question_tells_main_from_all_before(firmware, side):
    rig = Rig(firmware=firmware, side=side)
    before = rig.hand.read_codes()
    assert rig.hand.knows(Opcode.CALIBRATE_MID) == (firmware == "main")
    np.testing.assert_array_equal(rig.hand.read_codes(), before)


@pytest.mark.parametrize("channel", Channel)
def test_a_calibrated_channel_reads_2048_and_moves_when_it_is_commanded_as_before(channel):
    rig = Rig(firmware="main")
    codes = np.full(7, 30000)
    before = rig.shafts_deg_after(codes)
    window = CommandWindow.for_firmware("main")
    extend, grasp = window.extend_counts[channel], window.grasp_counts[channel]
    asked = extend + (grasp - extend) * codes[channel] / 65535
    assert rig.hand.trim(channel, 0).position_counts == pytest.approx(asked, abs=45)
    centred = rig.hand.calibrate_mid(channel)
    assert centred.position_counts == pytest.approx(2048, abs=3)
    assert centred.near_middle
    assert rig.hand.trim(channel, 0).position_counts == pytest.approx(2048, abs=3)
    moved = np.abs(rig.shafts_deg_after(codes) - before)
    assert moved[channel] > 4.0
    assert (np.delete(moved, channel) < 0.2).all()


def test_a_calibration_in_torque_mode_is_refused():
    rig = Rig(firmware="main")
    rig.hand.command_torques([50] * 7)
    with pytest.raises(RefusedError, match="torque mode"):
        rig.hand.calibrate_mid(Channel.INDEX)


def test_the_map_of_another_firmware_is_ten_degrees_off_on_the_thumb():
    rig = Rig(firmware="0.2.0")
    shafts = rig.shafts_deg_after(ActuationMap().codes_from_angles(np.deg2rad(ANGLES_DEG)))
    off = shafts - ANGLES_DEG
    assert off[Channel.THUMB_ABDUCTION] == pytest.approx(9.93, abs=TOLERANCE_DEG)
    assert off[Channel.THUMB_CMC_FLEXION] == pytest.approx(-9.93, abs=TOLERANCE_DEG)


def test_a_restart_is_noticed_and_leaves_the_mixed_state(caplog):
    rig = Rig(firmware="0.2.0")
    rig.hand.read_codes()
    assert rig.hand.boot_text == ""
    rig.electronics.reset("reset")
    with caplog.at_level(logging.WARNING):
        rig.hand.read_codes()
    assert "Non-power reset" in rig.hand.boot_text
    assert "has restarted" in caplog.text
    codec = ActuationMap.for_firmware("0.2.0", "mixed")
    shafts = rig.shafts_deg_after(codec.codes_from_angles(np.deg2rad(ANGLES_DEG)))
    np.testing.assert_allclose(shafts, ANGLES_DEG, atol=TOLERANCE_DEG)


@pytest.mark.parametrize("stray", [1, 7, 15])
def test_the_emulated_board_is_brought_back_into_step(stray):
    rig = Rig(firmware="0.2.0")
    InProcessLink(rig.electronics).write(b"\x7f" * stray)
    rig.hand = AeroHand(InProcessLink(rig.electronics), rig.electronics.clock)
    assert rig.hand.resynchronise() == stray
    assert rig.hand.read_temperatures().all()


def test_homing_is_waited_for():
    rig = Rig(Bench(BenchShaft(stop_low=-0.3, stop_high=5.1)), firmware="0.2.0")
    started = rig.electronics.clock.now()
    rig.hand.home()
    assert rig.electronics.clock.now() - started > 2.5
