"""The driver's row of each firmware version, against the board that the emulator makes of its own."""

import pytest

from aero.firmware import DEFAULT_FIRMWARE, FIRMWARE, VERSION_GROUPS, BootText, firmware_of
from firmware_emulator.firmware.frames import Opcode
from firmware_emulator.firmware.profiles import DEFAULT_VERSION, PROFILES, BootHoming


def test_driver_and_emulator_know_the_same_versions_and_take_the_same_for_granted():
    assert list(FIRMWARE) == list(PROFILES)
    assert DEFAULT_FIRMWARE == DEFAULT_VERSION == "0.2.0"


@pytest.mark.parametrize("version", PROFILES)
def test_what_the_driver_takes_a_version_for_is_what_the_board_does(version):
    row, board = FIRMWARE[version], PROFILES[version]
    assert (row.settings is not None) == (Opcode.SET_TOR in board.opcodes)
    if row.settings:
        assert (row.settings.speed, row.settings.torque) == (board.speed, board.torque)
    assert row.calibrate_mid == (Opcode.CALIBRATE_MID in board.opcodes)
    assert (row.boot_text is BootText.AUTO_HOMING) == (board.boot_homing is BootHoming.ALWAYS)
    assert (row.boot_text in (BootText.RESET, BootText.RESET_AND_PINGS)) == (board.boot_homing is BootHoming.ON_POWER)
    assert (row.boot_text is BootText.RESET) == (not board.pings)
    assert (row.boot_text is BootText.PINGS) == (not board.hand_line)


@pytest.mark.parametrize("versions", VERSION_GROUPS)
def test_versions_that_move_alike_do_so_on_the_board(versions):
    boards = {(board.speed, board.acceleration, board.torque) for board in map(PROFILES.get, versions)}
    assert len(boards) == len({FIRMWARE[version].calibration_states for version in versions}) == 1
    assert {FIRMWARE[version].moves_as for version in versions} == {versions[0]}


def test_an_unknown_version_is_named_with_those_that_are_known():
    with pytest.raises(ValueError, match=r"unknown firmware '9\.9'; known are pre, .*, main"):
        firmware_of("9.9")
