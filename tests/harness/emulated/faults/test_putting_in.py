"""Faults put into an emulated hand: in time, together, and never silently without effect."""

import hashlib
from contextlib import suppress
from itertools import pairwise

import numpy as np
import pytest

from aero.errors import AeroError
from hil.emulated.any_hand import open_target
from hil.emulated.faults import parse_fault
from hil.recordings.recorder import Recorder
from hil.targets.hand_errors import FaultNeverFiredError


def session(*texts, seconds=2.4, **options):
    """Open and close the hand; return the bytes that crossed the link and the readings."""
    with open_target(faults=[parse_fault(text) for text in texts], seed=3, **options) as target:
        codes = []
        for step in range(round(seconds / 0.1)):
            target.hand.command_codes([65000 * (step // 6 % 2)] * 7)
            target.clock.sleep_until(target.clock.now() + 0.1)
            codes.append(target.hand.read_codes())
        return target.wire.since(0, 0.0), np.array(codes)


BYTES = {
    "": "ba02d6b1bdeaf093",
    "motor_weak:ring=0.4@0.5": "cc5e6481d1c4aa1e",
    "encoder_noise:pinky": "8485d161587a4c9a",
    "supply_sags=0.6": "6661b4ff536a07d2",
    "cable_long:middle=7.6": "074beed4d1541e93",
    "late_goals=30": "539fd6a2f6bfe53c",
    "winding_reversed:index": "48ab5e6495c0b2a7",
    "trim_left_in:ring": "8dc434dd480cf06d",
    "servo_silent:index": "8231c506e67de97a",
    # Of the link one that loses nothing: what is asked again after a loss is the driver's own matter.
    "link_slow": "e0f7327e951b0558",
    "host_stalls=0.1": "b8a8ca9bffb62d54",
}
"""What crosses the link of hands with some faults, a stage and a layer each, as it was before they were one object."""


CLOSED = np.array([60000] * 4 + [0, 60000, 60000])


@pytest.mark.parametrize("text", BYTES)
def test_a_fault_gives_the_bytes_that_it_always_gave(text):
    with open_target(faults=map(parse_fault, text.split()), seed=5) as target:
        hand, clock = target.hand, target.clock
        for step in range(24):
            with suppress(AeroError, ConnectionError):
                hand.command_codes(CLOSED * (step // 6 % 2))
            clock.sleep_until(clock.now() + 0.15)
            for read in (hand.read_codes, hand.read_currents):
                with suppress(AeroError, ConnectionError):
                    read()
        digest = hashlib.sha256()
        for record in target.wire.since(0, 0.0):
            digest.update(f"{record.t!r} {record.direction} {record.data.hex()}".encode())
    assert digest.hexdigest()[:16] == BYTES[text]


@pytest.mark.parametrize("text", ["motor_dead:index", "cable_snapped:ring", "encoder_slip:index=200", "servo_missing"])
def test_a_fault_begins_at_its_time(text):
    healthy, _ = session()
    faulty, _ = session(f"{text}@1.2")
    first = next(i for i, (a, b) in enumerate(zip(healthy, faulty, strict=False)) if a != b)
    opened = healthy[0].t
    assert opened + 1.1 < faulty[first].t < opened + 1.6


@pytest.mark.parametrize(
    "text", ["board_restart@60", "motor_dead@60", "reply_lost=0", "link_silent=1@60", "boot_text@60"]
)
def test_a_fault_that_never_fired_fails_the_run(text):
    with pytest.raises(FaultNeverFiredError, match=text.partition("=")[0].partition("@")[0]):
        session(text, seconds=0.5)


def test_target_and_recording_say_what_is_wrong(tmp_path):
    with open_target(faults=[parse_fault("motor_weak:ring=0.4"), parse_fault("reply_stale=1")]) as target:
        assert target.describe().endswith(", with motor_weak:ring=0.4, reply_stale=1.0")
        recorder = Recorder(target, "excursion")
        recorder.begin()
        for code in (0, 30000):
            target.hand.command_codes([code] * 7)
            target.clock.sleep_until(target.clock.now() + 0.5)
            assert max(target.hand.read_codes()) < 5000
        assert recorder.finish().header.faults == "motor_weak:ring=0.4 reply_stale=1.0"


def test_another_error_is_not_hidden_by_a_fault_that_never_fired():
    with pytest.raises(KeyError), open_target(faults=[parse_fault("motor_dead@60")]):
        raise KeyError


@pytest.mark.parametrize(
    "texts",
    [
        ("encoder_scale=1.1", "encoder_scale=1.2"),
        ("board_runs_pre", "board_runs_0.1.0"),
        ("motor_dead", "motor_runaway"),
        ("motor_weak", "motor_weak"),
    ],
)
def test_what_cannot_be_combined_is_refused(texts):
    with pytest.raises(ValueError, match=texts[0].partition("=")[0]):
        session(*texts)


def test_a_board_that_runs_what_is_declared_is_no_fault():
    with pytest.raises(ValueError, match=r"runs 0\.2\.0 as declared"):
        session("board_runs_0.2.0")


@pytest.mark.parametrize("text", ["host_stalls", "link_hangs_up"])
def test_a_hand_behind_a_port_takes_no_faults_of_the_program(text):
    with pytest.raises(ValueError, match="the program's end"):
        open_target("pty", faults=[parse_fault(text)])


def test_a_physical_port_takes_no_faults():
    with pytest.raises(ValueError, match="aero-hil proxy"):
        open_target("/dev/ttyNoSuchHand", faults=[parse_fault("reply_lost")])


VERSIONS = ("pre", "0.1.0", "0.1.1", "0.1.2", "0.1.3", "0.1.4", "0.1.5", "0.2.0")


@pytest.mark.parametrize(("runs", "declared"), list(pairwise((*VERSIONS, VERSIONS[0]))))
def test_another_version_can_be_declared_than_the_board_runs(runs, declared):
    """The board is told by its profile, the driver's map by what was declared."""
    with open_target(firmware=declared, faults=[parse_fault(f"board_runs_{runs}")]) as target:
        assert target.firmware == declared
        assert target.truth.electronics.board.profile.version == runs


def test_a_program_on_the_board_takes_no_faults_of_the_firmware(tmp_path):
    with (
        pytest.raises(ValueError, match="cannot be injected into a firmware program"),
        open_target(faults=[parse_fault("board_restart")], firmware_program=tmp_path / "none"),
    ):
        pytest.fail("there is no such program")
