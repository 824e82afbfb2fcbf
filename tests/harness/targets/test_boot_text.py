"""Boot texts, as the emulated boards print them, are told apart as far as they differ."""

import pytest

from aero.firmware import FIRMWARE
from firmware_emulator.bench import Bench, BenchShaft
from firmware_emulator.hand import EmulatedHand
from hil.emulated.any_hand import open_target
from hil.targets.boot_text import identify
from hil.verdict.findings import failed
from hil.verdict.validation import validate


def boot_text(firmware, side="right", missing=None):
    """What a board prints after a reset that is no power-on."""
    hand = EmulatedHand(Bench(BenchShaft(stop_low=-1.0, stop_high=6.0)), firmware=firmware, side=side, start="reset")
    if missing is not None:
        hand.servos[missing].id = 99
    printed = bytearray()
    hand.on_transmit = printed.extend
    hand.clock.sleep_until(30.0 if firmware == "0.1.3" else 2.0)
    return printed.decode("utf-8", errors="replace")


@pytest.mark.parametrize("firmware", FIRMWARE)
@pytest.mark.parametrize("side", ["right", "left"])
def test_each_boot_text_names_its_version_and_side(firmware, side):
    board = identify(boot_text(firmware, side))
    text = FIRMWARE[firmware].boot_text
    assert board.versions == tuple(version for version, row in FIRMWARE.items() if row.boot_text is text)
    assert board.side == (None if firmware == "pre" else side)
    assert board.silent == ()


def test_a_servo_that_does_not_answer_is_named():
    board = identify(boot_text("0.1.0", missing=4))
    assert board.silent == (4,)
    assert "no answer from servo 4" in board.describe()


def test_another_text_is_no_known_version():
    assert identify("login: ").versions == ()
    assert "an unknown version" in identify("login: ").describe()


@pytest.mark.parametrize(("printed_by", "contradicts"), [("0.2.0", False), ("0.1.4", True)])
def test_a_restart_that_contradicts_the_named_firmware_is_found(printed_by, contradicts):
    text = boot_text(printed_by)
    with open_target(firmware="0.2.0") as target:
        target.hand._link._text += text.encode()
        result = validate(target, ["presence"])
    checks = [finding.check for finding in failed(result.findings)]
    assert ("boot_contradictions" in checks) is contradicts
    assert any(
        f"firmware {printed_by}" in event.text or "0.1.5 or 0.2.0" in event.text
        for event in result.results["presence"].recording.events
    )
