"""A recording survives the way to disk and back, and opens with the public reader."""

import json
import signal
from dataclasses import replace
from io import BytesIO

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from mcap.exceptions import McapError
from mcap.reader import make_reader
from mcap.records import Chunk, DataEnd, Footer, SummaryOffset
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType, Writer
from zstandard import ZstdCompressor

from hil.recordings.errors import UnusableFileError
from hil.recordings.mcap_chunks import ChunkWriter
from hil.recordings.mcap_file import CHUNK, MOST_TIMES, RecordingFile, _unpacked, read_recording, write_recording
from hil.recordings.recording import Event, Header, Recording, Series
from hil.targets.wire_log import WireRecord

HEADER = Header("staircase", "emulated", "right", "0.2.0", "paper", "homed", "reference", 3, {"levels": 20.0})
FINITE = st.floats(-1e9, 1e9)
TIMES = st.floats(0, 1e6)


@st.composite
def series(draw):
    rows, columns = draw(st.integers(0, 5)), draw(st.integers(1, 7))
    times = np.sort(draw(hnp.arrays(float, rows, elements=TIMES)))
    names = tuple(f"c{i}" for i in range(columns))
    return Series.of(names, ["mm"] * columns, times, draw(hnp.arrays(float, (rows, columns), elements=FINITE)))


wire = st.builds(WireRecord, TIMES, st.sampled_from(["to_hand", "from_hand"]), st.binary(min_size=1, max_size=16))
events = st.builds(Event, TIMES, st.sampled_from(["info", "warning", "error"]), st.text(max_size=10))


def in_time(strategy):
    return st.lists(strategy, max_size=5).map(lambda items: tuple(sorted(items, key=lambda item: item.t)))


@given(st.dictionaries(st.sampled_from(["pose", "camera", "delays"]), series()), in_time(wire), in_time(events))
def test_what_is_written_is_read(tmp_path_factory, series, wire, events):
    path = tmp_path_factory.mktemp("mcap") / "run.mcap"
    recording = Recording(HEADER, series, wire, events)
    write_recording(recording, path)
    assert read_recording(path) == recording


@pytest.mark.parametrize("compression", [CompressionType.NONE, CompressionType.ZSTD, CompressionType.LZ4])
def test_channels_of_other_programs_in_a_merged_file_are_passed_over(tmp_path, compression):
    series = {"pose": Series.of(["index"], ["m"], [0.5, 0.6], [[0.09], [0.08]])}
    recording = Recording(HEADER, series, events=(Event(0.25, "warning", "warm"),))
    write_recording(recording, tmp_path / "run.mcap")
    merge(tmp_path / "run.mcap", tmp_path / "merged.mcap", compression)
    assert read_recording(tmp_path / "merged.mcap") == recording


def merge(source, target, compression):
    """Copy a recording into a file with a camera's frames, another program's texts and its attachment."""
    with source.open("rb") as stream, target.open("wb") as out:
        writer = Writer(out, compression=compression)
        writer.start(profile="ros2", library="merge")
        image = writer.register_schema("sensor_msgs/msg/Image", "ros2msg", b"uint8[] data")
        text = writer.register_schema("std/String", "jsonschema", b"{}")
        others = [
            writer.register_channel("/camera", "cdr", image),
            writer.register_channel("/log", "json", text),
            writer.register_channel("/raw", "", 0),
        ]
        reader, channels = make_reader(stream), {}
        for schema, channel, message in reader.iter_messages():
            for other in others:
                writer.add_message(other, message.log_time, b"\0" * 200_000, message.log_time)
            if channel.topic not in channels:
                known = writer.register_schema(schema.name, schema.encoding, schema.data)
                channels[channel.topic] = writer.register_channel(channel.topic, channel.message_encoding, known)
            writer.add_message(channels[channel.topic], message.log_time, message.data, message.publish_time)
        writer.add_attachment(1, 1, "calibration", "text/yaml", b"fx: 1")
        writer.add_metadata("another program", {"format": "9"})
        for record in reader.iter_metadata():
            writer.add_metadata(record.name, record.metadata)
        writer.finish()


def test_the_public_reader_finds_named_numbers_with_units(tmp_path):
    command = Series.of(["index", "thumb_abduction"], ["m", "rad"], [0.5], [[0.09, 0.75]])
    write_recording(Recording(HEADER, {"command": command}, events=(Event(0.25, "warning", "warm"),)), tmp_path / "r")
    with (tmp_path / "r").open("rb") as stream:
        messages = {c.topic: (s, c, m) for s, c, m in make_reader(stream).iter_messages()}
    schema, channel, message = messages["/command"]
    assert (schema.encoding, channel.message_encoding, message.log_time) == ("jsonschema", "json", 500_000_000)
    assert json.loads(message.data) == {"t": 0.5, "index": 0.09, "thumb_abduction": 0.75}
    assert json.loads(schema.data)["properties"]["index"] == {"type": "number", "unit": "m"}
    log_schema, _, log = messages["/events"]
    assert log_schema.name == "foxglove.Log"
    assert json.loads(log.data)["timestamp"] == {"sec": 0, "nsec": 250_000_000}


def test_a_file_that_is_no_recording_is_refused(tmp_path):
    (tmp_path / "text").write_text("not an MCAP file")
    with pytest.raises(ValueError, match="not a readable MCAP"):
        read_recording(tmp_path / "text")
    with (tmp_path / "other").open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        writer.finish()
    with pytest.raises(ValueError, match="recorded by something else"):
        read_recording(tmp_path / "other")


def test_a_file_that_is_cut_anywhere_is_read_up_to_the_cut(tmp_path):
    path = tmp_path / "run"
    wire = tuple(WireRecord(0.001 * i, "to_hand", i.to_bytes(16, "little")) for i in range(2000))
    write_recording(Recording(HEADER, {}, wire), path)
    whole = path.read_bytes()
    lengths = []
    for part in np.linspace(0.1, 0.999, 12):
        path.write_bytes(whole[: int(part * len(whole))])
        found = read_recording(path)
        assert found.wire == wire[: len(found.wire)]
        lengths.append(len(found.wire))
    assert lengths == sorted(lengths)
    assert lengths[0] < 500
    assert lengths[-1] == len(wire)


def test_a_recording_that_was_begun_is_not_finished(tmp_path):
    RecordingFile(tmp_path / "run", replace(HEADER, finished=False)).finish(replace(HEADER, duration_s=3.0))
    assert read_recording(tmp_path / "run").header.duration_s == 3.0
    assert read_recording(tmp_path / "run").header.finished


def test_a_signal_in_the_middle_of_a_record_spoils_nothing(tmp_path, monkeypatch):
    write = ChunkWriter.write_chunk

    def interrupted(self, messages):
        for message in messages:
            write(self, [message])
            signal.raise_signal(signal.SIGINT)

    file = RecordingFile(tmp_path / "run", replace(HEADER, finished=False))
    monkeypatch.setattr(ChunkWriter, "write_chunk", interrupted)
    records = tuple(WireRecord(0.001 * i, "to_hand", bytes(16)) for i in range(CHUNK))
    for record in records[:-1]:
        file.add_wire(record)
    with pytest.raises(KeyboardInterrupt):
        file.add_wire(records[-1])
    monkeypatch.undo()
    file.finish(HEADER)
    assert read_recording(tmp_path / "run").wire == records


@given(st.integers(0, 2**32 - 1))
def test_a_flipped_bit_is_named_or_harmless(recorded, tmp_path_factory, seed):
    rng = np.random.default_rng(seed)
    damaged = bytearray(recorded)
    damaged[rng.integers(len(damaged))] ^= 1 << rng.integers(8)
    path = tmp_path_factory.mktemp("damaged") / "run.mcap"
    path.write_bytes(damaged)
    try:
        read_recording(path)
    except ValueError as error:
        assert str(path) in str(error)  # noqa: PT017 - most of them are read


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    path = tmp_path_factory.mktemp("mcap") / "run.mcap"
    command = Series.of(["index"], ["m"], np.arange(50.0), np.ones((50, 1)))
    wire = tuple(WireRecord(float(i), "to_hand", bytes(16)) for i in range(50))
    write_recording(Recording(HEADER, {"command": command}, wire, (Event(1.0, "info", "warm"),)), path)
    return path.read_bytes()


@pytest.mark.parametrize("chunks", [1, 40])
def test_a_small_file_that_unpacks_to_much_is_refused(tmp_path, chunks):
    """Each of its chunks is in bounds; a file of 240 kB used to fill over a gigabyte."""
    nothing = bytes(MOST_TIMES * 2**20 // chunks)
    wire = tuple(WireRecord(0.1 * place, "from_hand", nothing) for place in range(chunks))
    path = tmp_path / "run.mcap"
    write_recording(Recording(HEADER, {}, wire), path)
    assert path.stat().st_size < 2**18
    with pytest.raises(UnusableFileError, match="unpack to more than any recording of its size holds"):
        read_recording(path)


def test_a_chunk_that_unpacks_to_more_than_it_says_is_refused():
    data = ZstdCompressor().compress(bytes(1000))
    good = Chunk("zstd", data, 0, 0, 0, 1000)
    assert _unpacked(good) == bytes(1000)
    for size in (10, 999, 1001):
        with pytest.raises(McapError, match=f"unpacks to {size} bytes, and does not"):
            _unpacked(replace(good, uncompressed_size=size))


MESSAGES = st.lists(st.tuples(st.integers(0, 2), st.integers(0, 2**63), st.binary(max_size=40)), max_size=40)


@given(MESSAGES, st.integers(1, 40))
def test_a_file_written_by_chunks_is_read_as_one_of_the_library(messages, size):
    ours, library = BytesIO(), BytesIO()
    writer = ChunkWriter(ours, "aero-hil")
    channels = [writer.register(f"/{i}", "json", f"schema {i}", "jsonschema", b"{}") for i in range(3)]
    writer.add_metadata("about", {"key": "value"})
    for at in range(0, len(messages), size):
        writer.write_chunk([(channels[channel], t, content) for channel, t, content in messages[at : at + size]])
    writer.finish()
    theirs = Writer(library)
    theirs.start(library="aero-hil")
    schemas = [theirs.register_schema(f"schema {i}", "jsonschema", b"{}") for i in range(3)]
    channels = [theirs.register_channel(f"/{i}", "json", schema) for i, schema in enumerate(schemas)]
    theirs.add_metadata("about", {"key": "value"})
    for channel, t, content in messages:
        theirs.add_message(channels[channel], t, content, t)
    theirs.finish()
    read, expected = (make_reader(BytesIO(file.getvalue()), validate_crcs=True) for file in (ours, library))
    summary, of_library = read.get_summary(), expected.get_summary()
    assert list(read.iter_messages()) == list(expected.iter_messages())
    assert list(read.iter_metadata()) == list(expected.iter_metadata())
    assert (summary.channels, summary.schemas) == (of_library.channels, of_library.schemas)
    of_library.statistics.chunk_count = summary.statistics.chunk_count
    assert summary.statistics == of_library.statistics
    index = [(chunk.message_start_time, chunk.message_end_time) for chunk in summary.chunk_indexes]
    assert len(index) == summary.statistics.chunk_count


def test_the_summary_lists_the_place_of_every_group(tmp_path):
    """The public reader finds each group of the summary by its offset."""
    write_recording(Recording(HEADER, {}, (WireRecord(0.0, "to_hand", b"a"),)), tmp_path / "a.mcap")
    data = (tmp_path / "a.mcap").read_bytes()
    records = list(StreamReader(BytesIO(data), emit_chunks=True).records)
    listed = {record.group_opcode: record for record in records if isinstance(record, SummaryOffset)}
    summary = {type(record) for record in records[[type(one) for one in records].index(DataEnd) + 1 :]}
    assert len(listed) == len(summary - {SummaryOffset, Footer}) > 3
    for opcode, record in listed.items():
        assert data[record.group_start] == opcode
