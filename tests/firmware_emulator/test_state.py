"""What survives a restart of the board, and what does not."""

import json

import pytest

from firmware_emulator.firmware.nvs import Nvs
from tests.firmware_emulator.conftest import stopped_bench


def test_a_trim_survives_in_its_file(make_host, tmp_path):
    path = tmp_path / "hand.json"
    make_host(firmware="0.1.0", start="reset", nvs=Nvs(path)).link.read(241, 0.5)
    assert not path.exists()
    host = make_host(firmware="0.1.0", nvs=Nvs(path))
    assert host.ask(0x03, 3, -100 & 0xFFFF)
    assert json.loads(path.read_text())["ext3"] == 2141
    again = make_host(firmware="0.1.0", start="reset", nvs=Nvs(path))
    assert again.hand.board.window.extend[3] == 2141
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("firmware", ["0.1.0", "0.2.0"])
def test_a_hand_in_use_is_found_again_as_it_was_left(make_host, tmp_path, firmware):
    path = tmp_path / "hand.json"
    host = make_host(firmware=firmware, nvs=Nvs(path))
    host.ask(0x03, 5, 10)
    left = host.hand.board.window
    found = make_host(firmware=firmware, nvs=Nvs(path)).hand.board.window
    assert (found.extend, found.grasp) == (left.extend, left.grasp)


def test_a_reset_forgets_settings_speaks_again_and_leaves_the_servos_alone(make_host):
    host = make_host(firmware="0.1.0")
    host.ask(0x31, 3, 100)
    host.ask(0x03, 4, 10)
    host.send(0x11, *[30000] * 7)
    host.wait(0.5)
    before = host.words(0x22)
    host.link.write(b"\xa0" * 5)
    host.hand.reset()
    assert len(host.link.read(241, 1.0)) == 241
    host.wait(0.05)
    assert host.words(0x22)[3] == before[3]
    assert host.hand.board.speed == [32766] * 7
    assert host.hand.board.window.extend[4] == 3278 + 113


def test_a_power_cycle_makes_the_servos_limp_and_0_2_0_home(make_host):
    host = make_host(plant=stopped_bench())
    host.hand.reset("power_on")
    assert {servo.memory.get("torque_enable") for servo in host.hand.servos} == {0}
    assert host.link.read(30 + 37, 1.0).endswith(b"\xe2\x86\x92 homing\r\n")
    host.wait(10.0)
    assert all(34 <= warm <= 40 for warm in host.words(0x25))
