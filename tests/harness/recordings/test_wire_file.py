"""What a program of somebody else's exchanged with a hand is recorded, judged as a link, and shown."""

import itertools

import pytest
from click.testing import CliRunner
from full_disk import available, full_disk
from hypothesis import given
from hypothesis import strategies as st

from aero.channels import Channel
from aero.protocol import Opcode, make_positions, make_query, make_reply
from firmware_emulator.kernel import Kernel, VirtualClock
from hil.cli import main
from hil.recordings.mcap_file import read_recording
from hil.recordings.wire_file import WireFile, with_series

FULL_AT = 20_000
CODES = [1000 * channel for channel in Channel]


def begun(path, clock, **more):
    return WireFile(path, clock, target="/dev/ttyACM0", unit="physical", firmware="0.2.0", side="right", **more)


def exchanged(path, pieces, replies=1):
    clock = VirtualClock(Kernel())
    file = begun(path, clock)
    for piece in pieces:
        clock.sleep_until(clock.now() + 0.01)
        file.add("to_hand", piece)
        for _ in range(replies if piece[0] == Opcode.GET_POS else 0):
            file.add("from_hand", make_reply(Opcode.GET_POS, CODES))
    file.close()
    return read_recording(path)


@given(cuts=st.lists(st.integers(1, 31), max_size=4))
def test_frames_are_whole_however_a_program_writes_them(cuts, tmp_path_factory):
    data = make_positions(CODES) + make_query(Opcode.GET_POS)
    edges = [0, *sorted(cuts), len(data)]
    pieces = [data[a:b] for a, b in itertools.pairwise(edges) if a < b]
    recording = exchanged(tmp_path_factory.mktemp("wire") / "wire.mcap", pieces)
    assert [r.data for r in recording.wire if r.direction == "to_hand"] == [data[:16], data[16:]]


def test_commands_and_readings_are_found_in_the_frames(tmp_path):
    recording = with_series(exchanged(tmp_path / "wire.mcap", [make_positions(CODES), make_query(Opcode.GET_POS)]))
    assert recording["command_codes"].values.tolist() == [CODES]
    assert recording["codes"].values.tolist() == [CODES]


@pytest.mark.parametrize(("replies", "code", "said"), [(1, 0, "within limits"), (0, 1, "out of limits")])
def test_the_report_judges_the_link_and_says_what_it_cannot(replies, code, said, tmp_path):
    exchanged(tmp_path / "wire.mcap", [make_positions(CODES), *[make_query(Opcode.GET_POS)] * 20], replies)
    page = tmp_path / "report.html"
    result = CliRunner().invoke(main, ["report", str(tmp_path / "wire.mcap"), "--out", str(page)])
    assert result.exit_code == code, result.output
    assert said in result.output
    assert "the driver's order, scale and sign are not judged" in result.output
    assert "What was meant" in page.read_text()


@pytest.mark.skipif(not available, reason="needs a limit on the size of files")
def test_a_full_disk_ends_the_file_and_is_said_once(tmp_path):
    said = []
    file = begun(tmp_path / "wire.mcap", VirtualClock(Kernel()), on_failure=said.append)
    with full_disk(FULL_AT):
        for i in range(5000):
            file.add("from_hand", i.to_bytes(2) * 8)
    file.close()
    assert said == [file.failure]
    assert "wire.mcap" in str(file.failure)
    assert 100 < len(read_recording(tmp_path / "wire.mcap").wire) < 5000
