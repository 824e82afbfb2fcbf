"""`aero_port`: each test of any driver gets a new hand behind a path; a physical one stands behind the guard."""

import pytest

from hil.emulated.pty_process import serve

pytest_plugins = ["pytester"]
TESTS = """
import pytest
import serial

PATHS = []

def positions(port):
    with serial.Serial(port.path, 921600, timeout=5) as hand:
        hand.write(bytes([0x22]) + bytes(15))
        return hand.read(16)

def test_reads(aero_port):
    assert positions(aero_port)[0] == 0x22

def test_injects(aero_port):
    aero_port.inject("motor_dead:ring")
    assert [str(one) for one in aero_port.present()] == ["motor_dead:ring=1.0"]

def test_gets_a_new_hand(aero_port):
    assert aero_port.present() == ()
    assert positions(aero_port)[0] == 0x22
    assert aero_port.telemetry().joints.shape[1] == 16
    with serial.serial_for_url(aero_port.url, timeout=5) as hand:
        hand.write(bytes([0x22]) + bytes(15))
        assert hand.read(16)[0] == 0x22

@pytest.mark.fault("motor_weak:ring=0.4")
def test_has_its_fault_from_the_start(aero_port):
    assert [str(one) for one in aero_port.present()] == ["motor_weak:ring=0.4"]
    assert positions(aero_port)[0] == 0x22

@pytest.mark.fault("boot_text@60")
def test_fault_without_effect(aero_port):
    pass
"""


def test_each_test_has_a_hand_of_its_own(pytester):
    pytester.makepyfile(TESTS)
    result = pytester.runpytest("-p", "no:cacheprovider")
    result.assert_outcomes(passed=5, errors=1)
    result.stdout.fnmatch_lines(["*never fired: boot_text*@60*"])


def test_a_hand_on_a_port_stands_behind_the_guard(pytester):
    pytester.makepyfile(TESTS)
    with serve() as port:
        result = pytester.runpytest("-rs", f"--hil={port.path}", "-k", "reads or injects or start")
    result.assert_outcomes(passed=1, skipped=2, deselected=2)
    assert result.stdout.str().count("its faults are for an emulated hand") == 2


def test_a_misspelt_fault_is_an_error_before_any_hand(pytester):
    pytester.makepyfile(TESTS.replace("boot_text@60", "boot_txt"))
    result = pytester.runpytest()
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines(["*unknown fault 'boot_txt'*"])
