"""The second process opens what a killed program left, though the port goes and comes back, under another name too."""

import os
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from drawn import drawn
from guarded_hands import FailingLink
from serial.tools import list_ports

from aero import AeroHand
from aero.protocol import MAX_CODE
from aero.safety import Thresholds
from aero.safety.__main__ import HOMES_S, LONGEST_S, open_what_was_left
from aero.safety.known_port import KnownPort, _file
from aero.safety.opening import open_and_relax
from hil.emulated.emulated_hand import build_emulated
from hil.emulated.emulated_spec import EmulatedSpec
from model.units import load_unit

FIST = [0xE000] * 4 + [0] * 3


class Left:
    """An emulated hand that a killed program left as a fist, at full torque, and its port."""

    def __init__(self, **spec):
        self.electronics, _plant = build_emulated(load_unit("reference"), EmulatedSpec(seed=3, **spec))
        self.clock, self.present = self.electronics.clock, True
        AeroHand(FailingLink(self.electronics), self.clock).command_codes(FIST)
        self.clock.sleep_until(self.clock.now() + 1.0)
        self.began = self.clock.now()
        self.links = []

    def connect(self):
        """Open the port, as the second process does."""
        if not self.present:
            raise ConnectionError("there is no such port")
        self.links.append(FailingLink(self.electronics))
        return AeroHand(self.links[-1], self.clock)

    def lose_power(self, after_s, for_s):
        """Take board and port away for a while."""
        self.electronics.kernel.call_at(self.began + after_s, self.unplug)
        self.electronics.kernel.call_at(self.began + after_s + for_s, self.plug)

    def unplug(self):
        self.present = False
        for link in self.links:
            link.unplugged = True

    def plug(self):
        self.present = True
        self.electronics.reset("power_on")

    def open(self):
        return open_what_was_left(self.connect, self.clock, Thresholds(), settable=True)

    def assert_open_and_weak(self):
        self.clock.sleep_until(self.clock.now() + 0.5)
        codes = AeroHand(FailingLink(self.electronics), self.clock).read_codes()
        assert np.max(codes) < Thresholds().arrival * MAX_CODE
        assert [servo.memory.get("goal_torque") for servo in self.electronics.servos] == [Thresholds().limp_torque] * 7


@pytest.mark.parametrize("after_s", drawn(np.arange(0.0, 4.0, 0.5), 3))
@pytest.mark.parametrize("for_s", [0.4, 8.0])
def test_a_moment_without_power_while_the_hand_is_opened_leaves_it_open_and_weak(after_s, for_s):
    left = Left()
    left.lose_power(after_s, for_s)
    assert left.open() is None
    left.assert_open_and_weak()


def test_a_port_that_never_comes_back_is_given_up():
    left = Left()
    left.lose_power(1.0, 1000.0)
    assert "there is no such port" in left.open()
    waited_s = left.clock.now() - left.began - 1.0
    assert Thresholds().opening_patience_s <= waited_s < Thresholds().opening_patience_s + 0.5


def test_a_port_that_is_never_well_is_given_up():
    left = Left()
    connect = left.connect

    def broken():
        hand = connect()
        left.links[-1].unplugged = True
        return hand

    left.connect = broken
    assert "has it been unplugged" in left.open()
    assert left.clock.now() - left.began < LONGEST_S + 1.0


def port(device, serial_number, vid=0x303A):
    return SimpleNamespace(device=device, vid=vid, pid=0x1001, serial_number=serial_number)


def test_a_device_is_found_by_its_serial_number_whatever_its_port_is_called_by_now(monkeypatch):
    here = [port("/dev/ttyX0", "A"), port("/dev/ttyX1", "B"), port("/dev/ttyX2", None)]
    monkeypatch.setattr(list_ports, "comports", lambda: list(here))
    usb, unnumbered, url = KnownPort.of("/dev/ttyX0"), KnownPort.of("/dev/ttyX2"), KnownPort.of("socket://bench:4000")
    assert usb.now() == "/dev/ttyX0"
    here[:] = [port("/dev/ttyX0", "B")]
    with pytest.raises(ConnectionError, match="serial number A is gone"):
        usb.now()
    here[:] = [port("/dev/ttyX0", "B"), port("/dev/ttyX3", "A", vid=0x10C4)]
    with pytest.raises(ConnectionError, match="gone"):
        usb.now()
    here.append(port("/dev/ttyX4", "A"))
    assert usb.now() == "/dev/ttyX4"
    assert unnumbered.now() == "/dev/ttyX2"
    assert url.now() == "socket://bench:4000"


@pytest.mark.skipif(os.name != "posix", reason="needs pseudo-terminals")
def test_a_pseudo_terminal_of_the_same_name_is_another_port():
    """The second process of the program before opened the next hand, and its own program found the port taken."""
    ends = os.openpty()
    name = os.ttyname(ends[1])
    known, made_ns = KnownPort.of(name), Path(name).stat().st_ctime_ns
    os.write(ends[1], b"to the hand")
    assert known.now() == name
    for end in ends:
        os.close(end)
    with pytest.raises(ConnectionError, match="left alone"):
        known.now()
    # The kernel dates files by its tick of some milliseconds; a port that a program has opened is older than that.
    ends = os.openpty()
    while Path(name).stat().st_ctime_ns == made_ns:
        for end in ends:
            os.close(end)
        ends = os.openpty()
    assert os.ttyname(ends[1]) == name, "the system gives the lowest number"
    with pytest.raises(ConnectionError, match="left alone"):
        known.now()
    for end in ends:
        os.close(end)


@pytest.mark.skipif(os.name != "posix", reason="needs symbolic links")
def test_a_link_names_its_device_whatever_is_behind_it_by_now(tmp_path):
    link = tmp_path / "hand"
    (tmp_path / "one").touch()
    link.symlink_to(tmp_path / "one")
    known = KnownPort.of(str(link))
    link.unlink()
    (tmp_path / "other").touch()
    link.symlink_to(tmp_path / "other")
    assert known.now() == str(link)


def without_power(left, for_s):
    """Return a hand whose board has no power for a while; the port, that of an adapter, stays."""
    link = FailingLink(left.electronics)
    link.silent = True

    def power_on():
        link.silent = False
        left.electronics.reset("power_on")

    left.electronics.kernel.call_at(left.began + for_s, power_on)
    return AeroHand(link, left.clock)


@pytest.mark.parametrize("for_s", drawn([3.0, 7.0, 9.0], 1))
def test_a_board_without_power_is_opened_and_left_weak_by_the_program_itself(for_s):
    """It homes once it has power, so that all takes longer than the patience for a hand that does not open."""
    left = Left()
    hand = without_power(left, for_s)
    assert open_and_relax(hand, left.clock, Thresholds(), settable=True, last_codes=FIST, silent=True) is None
    left.assert_open_and_weak()


def test_a_silent_board_is_tried_again_by_the_second_process_for_as_long_as_one_may_home():
    left = Left()
    hand = without_power(left, 45.0)
    assert open_what_was_left(lambda: hand, left.clock, Thresholds(), settable=True) is None
    left.assert_open_and_weak()
    never = Left()
    silent = without_power(never, 1000.0)
    assert open_what_was_left(lambda: silent, never.clock, Thresholds(), settable=True) is not None
    assert HOMES_S <= never.clock.now() - never.began < HOMES_S + 20.0


def test_a_missing_file_has_no_identity(tmp_path):
    """One missing port is never taken for another."""
    assert _file(str(tmp_path / "none")) is None
