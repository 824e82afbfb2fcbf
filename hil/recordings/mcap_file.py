"""Recordings on disk, as MCAP with JSON messages that Foxglove and PlotJuggler open directly.

One topic a series (`/command`, one number a column), `/wire/to_hand` and `/wire/from_hand` (bytes in hexadecimal),
`/events` (schema `foxglove.Log`). The header is the metadata record `aero-hil`, written at the beginning and again
at the end. The field `t` of a message is the exact time since the recording's start, s; the log time is the date.
"""

import dataclasses
import hashlib
import json
import os
import struct
from array import array
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing, suppress
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import Any, BinaryIO, TypeVar

import numpy as np
from lz4.frame import LZ4FrameDecompressor
from mcap.exceptions import EndOfFile, McapError
from mcap.records import Channel, Chunk, McapRecord, Message, Metadata, Schema
from mcap.stream_reader import StreamReader, breakup_chunk
from zstandard import ZstdDecompressor, ZstdError

from aero.actuation import CommandWindow
from aero.regular_file import open_regular
from aero.safety.interrupts import uninterrupted
from aero.whole_file import begin_file, whole
from aero_hil_toml import filled
from hil.recordings.errors import UnusableFileError, writing
from hil.recordings.mcap_chunks import ChunkWriter
from hil.recordings.recording import Event, Header, Recording, Series, Severity
from hil.recordings.series_layout import conformed
from hil.targets.wire_log import Direction, WireRecord

Content = TypeVar("Content")
METADATA = "aero-hil"
FOREIGN = "protobuf"
"""Encoding of messages for other programs only, see `hil.report.foxglove`."""
FORMAT = "1"
DIGEST = "sha256"
"""Metadata key of the header's digest; missing in recordings of version 0.1.0."""
SERIES_PREFIX = "aero.series."
DIRECTIONS: tuple[Direction, ...] = ("to_hand", "from_hand")
LOG_LEVELS: dict[Severity, int] = {"info": 2, "warning": 3, "error": 4}
"""Levels of the schema `foxglove.Log`."""
SEVERITIES = {level: severity for severity, level in LOG_LEVELS.items()}
TOPIC_OF: dict[Direction, str] = {direction: f"/wire/{direction}" for direction in DIRECTIONS}
WIRE_TOPICS = {topic: direction for direction, topic in TOPIC_OF.items()}
CHUNK = 128
"""Messages per compressed chunk: a quarter of a second of a staircase."""
BUFFER_BYTES = 4096
"""Size of the write buffer for compressed data."""
LARGEST_RECORD = 64 * 2**20
"""Threshold of record size, bytes; above it the file counts as damaged. Real records have a few kB."""
LEAST_ROOM, MOST_TIMES = 2**21, 10
"""Decompression limit: the larger of 2 MiB and 10 times the file size. Real recordings expand 2 to 5 times."""
FARTHEST_NS = 2**63
"""Limit of dates, ns from 1970. Source: MCAP times are 64 bits wide."""
DAMAGED = (
    McapError,
    ZstdError,
    struct.error,
    LookupError,
    TypeError,
    AttributeError,
    ValueError,
    ArithmeticError,
    OSError,
    MemoryError,
    RecursionError,
)
"""Exceptions that a damaged file can raise in the reader."""

NUMBER = {"type": "number"}
WIRE_TEXT = '{"t": %r, "hex": "%s"}'
WIRE_SCHEMA = {"type": "object", "properties": {"t": NUMBER, "hex": {"type": "string"}}}
LOG_SCHEMA = {
    "type": "object",
    "properties": {
        "timestamp": {"type": "object", "properties": {"sec": {"type": "integer"}, "nsec": {"type": "integer"}}},
        "level": {"type": "integer"},
        "message": {"type": "string"},
        "name": {"type": "string"},
        "file": {"type": "string"},
        "line": {"type": "integer"},
        "t": NUMBER,
    },
}


class RecordingFile:
    """Incremental writer of a recording, whose file stays readable after any ending of the program.

    Small chunks limit the loss of a killed program to less than a second of data. Signals are deferred during a
    write, because an incomplete record would make the rest of the file unreadable.
    """

    def __init__(self, path: Path, header: Header) -> None:
        """Create the file, replacing an existing one.

        Raises:
            OSError: the file cannot be written.
        """
        self._stream = begin_file(path, BUFFER_BYTES)
        self._experiment = header.experiment
        self._epoch_ns = epoch_ns(header)
        self._foreign: dict[str, int] = {}
        """Topics of messages for other programs, to their channels."""
        self._series: dict[str, tuple[int, str]] = {}
        """Series by name: channel, and `%` format of a sample's JSON text (time, then values)."""
        self._pending: list[tuple[int, float, str, Sequence[Any]]] = []
        """Buffered messages: channel, time (s), `%` format, values."""
        with uninterrupted():
            self._writer = ChunkWriter(self._stream, "aero-hil")
            self._add_header(header)
        self._wire = {way: self._channel(TOPIC_OF[way], "aero.wire", WIRE_SCHEMA) for way in DIRECTIONS}
        self._events = self._channel("/events", "foxglove.Log", LOG_SCHEMA)

    def add_series(self, name: str, columns: tuple[str, ...], units: tuple[str, ...]) -> None:
        """Register a series before its first sample; a second call does nothing."""
        if name in self._series:
            return
        properties = {"t": {**NUMBER, "unit": "s"}}
        properties |= {c: {**NUMBER, "unit": u} for c, u in zip(columns, units, strict=True)}
        channel = self._channel(f"/{name}", SERIES_PREFIX + name, {"type": "object", "properties": properties})
        text = "{" + ", ".join(f"{json.dumps(key).replace('%', '%%')}: %r" for key in ("t", *columns)) + "}"
        self._series[name] = channel, text

    def add_sample(
        self, name: str, columns: tuple[str, ...], units: tuple[str, ...], t: float, row: Sequence[float]
    ) -> None:
        """Write one row, (len(columns),), of a series."""
        if name not in self._series:
            self.add_series(name, columns, units)
        channel, text = self._series[name]
        self._add(channel, t, text, row)

    def add_whole_series(self, name: str, series: Series) -> None:
        """Write all samples of a series."""
        self.add_series(name, series.columns, series.units)
        for t, row in zip(series.times.tolist(), series.values.tolist(), strict=True):
            self.add_sample(name, series.columns, series.units, t, row)

    def add_wire(self, record: WireRecord, start: float = 0.0) -> None:
        """Write bytes that crossed the link; `start` (s) is the zero of the recording's times."""
        at, direction, data = record
        self._add(self._wire[direction], at - start, WIRE_TEXT, (data.hex(),))

    def add_event(self, event: Event) -> None:
        """Write an event."""
        sec, nsec = divmod(self._epoch_ns + round(event.t * 1e9), 10**9)
        log = {"timestamp": {"sec": sec, "nsec": nsec}, "level": LOG_LEVELS[event.severity], "message": event.text}
        log |= {"name": self._experiment, "file": "", "line": 0}
        self._add(self._events, event.t, '{"t": %r, %s', (json.dumps(log).removeprefix("{"),))

    def add_for_viewers(self, topic: str, schema_name: str, schema: Callable[[], bytes], t: float, body: bytes) -> None:
        """Write a Protobuf message, which `read_recording` ignores; `schema` is called once a topic."""
        if topic not in self._foreign:
            self._foreign[topic] = self._register(topic, schema_name, FOREIGN, schema(), FOREIGN)
        self._add(self._foreign[topic], t, "", (body,))

    def finish(self, header: Header) -> None:
        """Write the final header and the index for random access, and close the file."""
        try:
            with uninterrupted():
                self._write_pending()
                self._add_header(header)
                self._writer.finish()
                self._stream.flush()
        finally:
            self.close()

    def close(self) -> None:
        """Close the file without completing it; a second call does nothing."""
        with suppress(OSError):  # the rest of the buffer cannot be written
            self._stream.close()

    def _add_header(self, header: Header) -> None:
        content = dataclasses.asdict(header)
        record = {"format": FORMAT, "header": json.dumps(content), DIGEST: digest(content)}
        self._writer.add_metadata(METADATA, record)

    def _channel(self, topic: str, schema_name: str, schema: dict[str, Any]) -> int:
        return self._register(topic, schema_name, "jsonschema", json.dumps(schema).encode(), "json")

    def _register(self, topic: str, schema_name: str, schema_encoding: str, schema: bytes, encoding: str) -> int:
        with uninterrupted():
            return self._writer.register(topic, encoding, schema_name, schema_encoding, schema)

    def _add(self, channel: int, t: float, text: str, values: Sequence[Any]) -> None:
        """Buffer a message: a `%` format for time and values or, if the format is empty, the bytes in `values`."""
        self._pending.append((channel, t, text, values))
        if len(self._pending) >= CHUNK:
            with uninterrupted():
                self._write_pending()

    def _write_pending(self) -> None:
        epoch_ns, pending, self._pending = self._epoch_ns, self._pending, []
        # Equal to the output of `json.dumps`, at a fifth of the cost.
        self._writer.write_chunk(
            (channel, epoch_ns + round(t * 1e9), (text % (t, *values)).encode() if text else values[0])
            for channel, t, text, values in pending
        )


def digest(content: Mapping[str, Any]) -> str:
    """Return the SHA-256 of a JSON object in hexadecimal, independent of key order."""
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def epoch_ns(header: Header) -> int:
    """Return the start date of a recording, ns since 1970; 0 if unknown."""
    return round(datetime.fromisoformat(header.started).timestamp() * 1e9) if header.started else 0


def write_recording(recording: Recording, path: Path) -> None:
    """Write `recording` to `path` atomically.

    Raises:
        CannotBeWrittenError: the file cannot be written.
    """
    with writing(path), whole(path) as draft, closing(RecordingFile(draft, recording.header)) as file:
        for name, series in recording.series.items():
            file.add_whole_series(name, series)
        for record in recording.wire:
            file.add_wire(record)
        for event in recording.events:
            file.add_event(event)
        file.finish(recording.header)


def read_recording(path: Path) -> Recording:
    """Read a recording; of a truncated file, return the data before the end.

    Raises:
        OSError: the file cannot be read, or is a pipe or a device.
        UnusableFileError: not an MCAP file, not from aero-hil, or damaged; the message says which.
    """
    return _read(path, _assembled)


def read_header(path: Path) -> Header:
    """Read the first header of a recording, in which the duration is unknown.

    Raises:
        OSError: the file cannot be read, or is a pipe or a device.
        UnusableFileError: not from aero-hil, or damaged; the message says which.
    """
    return _read(path, _first_header)


def _read(path: Path, assemble: Callable[[Iterator[McapRecord], Path], Content]) -> Content:
    with open_regular(path) as stream:
        try:
            return assemble(_records(stream), path)
        except UnusableFileError:
            raise
        except DAMAGED as error:
            raise UnusableFileError(
                f"{path} is not a readable MCAP file of a recording: {type(error).__name__} {error}"
            ) from error


def _first_header(records: Iterator[McapRecord], path: Path) -> Header:
    for record in records:
        if isinstance(record, Metadata) and record.name == METADATA:
            return _header(record, path)
    raise UnusableFileError(f"{path} has no header of aero-hil")


def _records(stream: BinaryIO) -> Iterator[McapRecord]:
    """Yield the records in file order, up to the end or the truncation."""
    try:
        left = max(LEAST_ROOM, MOST_TIMES * os.fstat(stream.fileno()).st_size)
        for record in StreamReader(
            stream, record_size_limit=LARGEST_RECORD, emit_chunks=True, validate_crcs=True
        ).records:
            if not isinstance(record, Chunk):
                yield record
                continue
            # A limit on the sum, because many chunks of valid size could together fill the memory.
            left -= record.uncompressed_size
            if left < 0:
                raise McapError("its chunks unpack to more than any recording of its size holds")
            yield from breakup_chunk(replace(record, compression="", data=_unpacked(record)), validate_crc=True)
    except (EndOfFile, struct.error):
        if stream.read(1):
            raise  # damaged: data follow, so the file is not just truncated


def _unpacked(chunk: Chunk) -> bytes:
    """Decompress a chunk, up to its declared size.

    Raises:
        McapError: the size differs from the declared one, or the compression is unknown.
    """
    most = chunk.uncompressed_size + 1
    if chunk.compression == "zstd":
        data = ZstdDecompressor().stream_reader(chunk.data).read(most)
    elif chunk.compression == "lz4":
        data = LZ4FrameDecompressor().decompress(chunk.data, max_length=most)
    elif not chunk.compression:
        data = chunk.data
    else:
        raise McapError(f"a chunk is packed as {chunk.compression!r}")
    if len(data) != chunk.uncompressed_size:
        raise McapError(f"a chunk says that it unpacks to {chunk.uncompressed_size} bytes, and does not")
    return data


def _assembled(records: Iterator[McapRecord], path: Path) -> Recording:
    header: Header | None = None
    topics: dict[int, str] = {}
    schemas: dict[int, dict[str, Any]] = {}
    series: dict[str, _Table] = {}
    wire: list[WireRecord] = []
    events: list[Event] = []
    for record in records:
        if isinstance(record, Metadata) and record.name == METADATA:
            header = _header(record, path)  # the last header counts, because the first lacks the duration
        elif isinstance(record, Schema) and record.name.startswith(SERIES_PREFIX):
            schemas[record.id] = json.loads(record.data)
        elif isinstance(record, Channel) and record.message_encoding == "json":
            # Channels of other programs, for example from a merged camera file, are ignored.
            if record.schema_id in schemas:
                series.setdefault(record.topic, _Table(schemas[record.schema_id]))
                topics[record.id] = record.topic
            elif record.topic in (*WIRE_TOPICS, "/events"):
                topics[record.id] = record.topic
        elif isinstance(record, Message) and record.channel_id in topics:
            topic, body = topics[record.channel_id], json.loads(record.data)
            if topic in WIRE_TOPICS:
                wire.append(WireRecord(body["t"], WIRE_TOPICS[topic], bytes.fromhex(body["hex"])))
            elif topic == "/events":
                events.append(Event(body["t"], SEVERITIES[body["level"]], body["message"]))
            else:
                series[topic].add(body)
    if header is None:
        raise UnusableFileError(f"{path} has no header of aero-hil; it was recorded by something else, or cut at once")
    try:
        found = {topic[1:]: conformed(topic[1:], table.series()) for topic, table in series.items()}
    except UnusableFileError as error:
        raise UnusableFileError(f"{path}: {error}") from error
    wire.sort(key=lambda record: record.t)  # stable: bytes of one instant keep their order
    return Recording(header, found, tuple(wire), tuple(events))


def _header(record: Metadata, path: Path) -> Header:
    if record.metadata["format"] != FORMAT:
        raise UnusableFileError(
            f"{path} has recording format {record.metadata['format']}, this version reads {FORMAT}; "
            "use the aero-hil version that wrote it"
        )
    content = json.loads(record.metadata["header"])
    if record.metadata.get(DIGEST, digest(content)) != digest(content):
        raise UnusableFileError(f"{path} is damaged: its header does not fit its SHA-256")
    header = filled(Header, content, "its header")
    if abs(epoch_ns(header)) >= FARTHEST_NS:
        raise ValueError(f"its header.started is {header.started}")
    try:
        CommandWindow.for_firmware(header.firmware, header.window, header.side)
    except ValueError as error:
        raise UnusableFileError(f"{path}: {error}; a newer version of aero-hil may have written it") from error
    return header


class _Table:
    """Growing buffer of a series' samples in the schema's columns."""

    def __init__(self, schema: Mapping[str, Any]) -> None:
        self._units = {name: spec["unit"] for name, spec in schema["properties"].items() if name != "t"}
        # Flat arrays instead of a dict a line, which would take twenty times the memory.
        self._times, self._values = array("d"), array("d")

    def add(self, row: Mapping[str, Any]) -> None:
        """Append one sample."""
        self._times.append(row["t"])
        self._values.extend(row[name] for name in self._units)

    def series(self) -> Series:
        """Return all samples as a series."""
        values = np.array(self._values).reshape(len(self._times), len(self._units))
        return Series(tuple(self._units), tuple(self._units.values()), np.array(self._times), values)
