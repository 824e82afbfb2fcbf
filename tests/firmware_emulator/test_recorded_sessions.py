"""The emulated board against the real firmware: recorded sessions of eight versions and both hands, to the nanosecond.

`traces/README.md` says where the recordings come from. No compiler is needed.
"""

import lzma
import math
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import pytest
from drawn import drawn
from nightly import NIGHTLY

from firmware_emulator.compare.run import compare, contender
from firmware_emulator.compare.trace_file import TraceFileError, read_traces, write_traces
from firmware_emulator.servo import servo
from firmware_emulator.servo.parameters import HLS3606M
from firmware_emulator.servo.protection import TEMPERATURE, Protection

TRACES = Path(__file__).parent / "traces"
RECORDED = {
    (version, hand): sessions
    for version, sessions in (
        *((v, 21) for v in ("pre", "0.1.0", "0.1.1", "0.1.3", "0.1.4", "0.1.5", "0.2.0")),
        ("main", 29),
    )
    for hand in ("right", "left")
}
"""Sessions of each version and hand."""
HOMINGS = 3
"""Of those, sessions in a file of their own: they hold most of the events."""


QUICK = {("pre", "right"), ("0.2.0", "right"), ("main", "left")}
"""In the default suite; the slow tests have all."""
HOMED = {("0.2.0", "right"), ("pre", "left"), ("0.1.0", "right"), ("0.1.3", "left"), ("main", "left")}
"""A hand of each version that homes in its own way; nightly tests have all."""


RECORDED_SERVOS = replace(
    HLS3606M,
    current_floor_ma=28.0,
    current_rise_ma=32.0,
    current_knee_counts=32.0,
    current_blocked_counts=math.inf,
    rest_temperature_c=38.0,
    cooling_s=400.0,
)
"""Emulated servos behind the real firmware in the recordings; its events hold their readings."""


class RecordedWarmth(NamedTuple):
    """Heating of the servos in the recordings: a rate that saturates with the current."""

    case_c: float

    def after(self, current_a, speed_counts, seconds, parameters):
        square = current_a**2
        final = parameters.rest_temperature_c + 0.15 * square / (square + 0.4**2) * parameters.cooling_s
        return RecordedWarmth(final + (self.case_c - final) * math.exp(-seconds / parameters.cooling_s))


class RecordedProtection(Protection):
    """Protection of the servos in the recordings: a cut-out at 70 °C that a new goal ends."""

    def status(self, memory, seconds):
        hot = memory.get("present_temperature") > 70
        return super().status(memory, seconds) | (TEMPERATURE if hot else 0)


@pytest.fixture(autouse=True)
def recorded_heat(monkeypatch):
    monkeypatch.setattr(servo, "Warmth", RecordedWarmth)
    monkeypatch.setattr(servo, "Protection", RecordedProtection)


def differences(version, hand, path, *, kind=None):
    """What differs in each session, or each of a kind, in order; None where nothing does."""
    firmware = replace(contender(version, hand), servos=RECORDED_SERVOS)
    for recorded in read_traces(path):
        if kind not in (None, recorded.kind):
            continue
        found = compare(recorded.session, firmware, recorded.trace).difference
        yield found and "\n".join([recorded.session.name, *found.lines(("emulated", "real"))])


@pytest.mark.parametrize(
    ("version", "hand"), [key if key in QUICK else pytest.param(*key, marks=pytest.mark.slow) for key in RECORDED]
)
def test_every_event_is_that_of_the_real_board(version, hand):
    found = list(differences(version, hand, TRACES / f"{version}-{hand}.jsonl.xz"))
    assert found == [None] * (RECORDED[version, hand] - HOMINGS)


@pytest.mark.parametrize(("version", "hand"), drawn([key for key in RECORDED if key not in QUICK], 4))
def test_every_version_boots_as_the_real_board(version, hand):
    """After three causes of a reset, all servos or five: its text, what it asks, and when."""
    assert list(differences(version, hand, TRACES / f"{version}-{hand}.jsonl.xz", kind="boot")) == [None] * 6


@pytest.mark.parametrize(
    ("version", "hand"),
    [
        key if key == ("0.2.0", "right") else pytest.param(*key, marks=pytest.mark.slow)
        for key in RECORDED
        if NIGHTLY or key in HOMED
    ],
)
def test_every_event_of_homing_is_that_of_the_real_board(version, hand):
    found = list(differences(version, hand, TRACES / f"{version}-{hand}-homing.jsonl.xz"))
    assert found == [None] * HOMINGS


def test_another_version_is_told_from_what_was_recorded():
    found = differences("0.1.5", "right", TRACES / "0.2.0-right.jsonl.xz")
    assert any("first difference on the " in said for said in found if said)


def recorded():
    return next(one for one in read_traces(TRACES / "main-left.jsonl.xz") if one.kind == "damage")


def test_what_is_written_is_read_again(tmp_path):
    path = tmp_path / "some.jsonl.xz"
    write_traces(path, [recorded(), recorded()])
    assert list(read_traces(path)) == [recorded()] * 2


@pytest.mark.parametrize("content", [b"no json\n", b'{"kind": "boot"}\n', b'{"steps": [{"do": "dance"}]}\n', b"[]\n"])
def test_a_damaged_file_is_named_with_its_line(tmp_path, content):
    path = tmp_path / "bad.jsonl.xz"
    path.write_bytes(lzma.compress(content))
    with pytest.raises(TraceFileError, match=r"bad\.jsonl\.xz, line 1: no recorded sessions"):
        list(read_traces(path))


def test_a_file_that_was_cut_is_named(tmp_path):
    path = tmp_path / "cut.jsonl.xz"
    whole = (TRACES / "main-left.jsonl.xz").read_bytes()
    path.write_bytes(whole[: len(whole) // 2])
    with pytest.raises(TraceFileError, match=r"cut\.jsonl\.xz"):
        list(read_traces(path))


def test_sessions_that_cannot_be_written_leave_the_old_ones(tmp_path):
    path = tmp_path / "kept.jsonl.xz"
    write_traces(path, [recorded()])
    before = path.read_bytes()

    def broken():
        yield recorded()
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_traces(path, broken())
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]
