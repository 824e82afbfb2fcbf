"""Recordings on disk, as MCAP with JSON messages, so that Foxglove and PlotJuggler open them as they are.

One topic a series (`/command`, one number a column), `/wire/to_hand` and `/wire/from_hand` (bytes in hexadecimal),
`/events` (Foxglove's own log schema). The header is the metadata record `aero-hil`. Times are seconds since the start
of the recording, in the message to the bit and in MCAP's log time to the nanosecond.
"""

from __future__ import annotations

import dataclasses
import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
from mcap.exceptions import EndOfFile, McapError
from mcap.reader import McapReader, make_reader
from mcap.writer import Writer

from hil.recordings.recording import Event, Header, Recording, Series, Severity
from hil.targets.wire_log import Direction, WireRecord

METADATA = "aero-hil"
FORMAT = "1"
SERIES_PREFIX = "aero.series."
DIRECTIONS: tuple[Direction, ...] = ("to_hand", "from_hand")
LOG_LEVELS: dict[Severity, int] = {"info": 2, "warning": 3, "error": 4}
"""Levels of the schema `foxglove.Log`."""

NUMBER = {"type": "number"}
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


def write_recording(recording: Recording, path: Path) -> None:
    """Write `recording` to `path`, replacing what is there.

    Raises:
        OSError: the file cannot be written.
    """
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start(profile="", library="aero-hil")
        header = dataclasses.asdict(recording.header)
        writer.add_metadata(METADATA, {"format": FORMAT, "header": json.dumps(header)})
        for name, series in recording.series.items():
            _write_series(writer, name, series)
        wire = {d: _channel(writer, f"/wire/{d}", "aero.wire", WIRE_SCHEMA) for d in DIRECTIONS}
        for record in recording.wire:
            _add(writer, wire[record.direction], record.t, {"hex": record.data.hex()})
        channel = _channel(writer, "/events", "foxglove.Log", LOG_SCHEMA)
        for event in recording.events:
            sec, nsec = divmod(_nanoseconds(event.t), 10**9)
            log = {"timestamp": {"sec": sec, "nsec": nsec}, "level": LOG_LEVELS[event.severity], "message": event.text}
            _add(writer, channel, event.t, log | {"name": recording.header.experiment, "file": "", "line": 0})
        writer.finish()  # type: ignore[no-untyped-call]  # mcap leaves this one unannotated


def read_recording(path: Path) -> Recording:
    """Read a recording that `write_recording` wrote; nothing is lost on the way.

    Raises:
        OSError: the file cannot be read.
        ValueError: it is no MCAP file, or not one of this project's; the message says which.
    """
    with path.open("rb") as stream:
        try:
            reader = make_reader(stream)
            header = _header(reader, path)
            return _contents(reader, header)
        except (McapError, struct.error, OSError) as error:
            raise ValueError(f"{path} is not a readable MCAP file ({error}); was the run interrupted?") from error


def _header(reader: McapReader, path: Path) -> Header:
    for record in reader.iter_metadata():
        if record.name == METADATA:
            if record.metadata["format"] != FORMAT:
                raise ValueError(
                    f"{path} has recording format {record.metadata['format']}, this version reads {FORMAT}; "
                    "use the aero-hil version that wrote it"
                )
            return Header(**json.loads(record.metadata["header"]))
    raise ValueError(f"{path} is an MCAP file without a header of aero-hil; it was recorded by something else")


def _contents(reader: McapReader, header: Header) -> Recording:
    rows: dict[str, list[dict[str, Any]]] = {}
    schemas: dict[str, dict[str, Any]] = {}
    wire: list[WireRecord] = []
    events: list[Event] = []
    severities = {level: severity for severity, level in LOG_LEVELS.items()}
    directions = {f"/wire/{direction}": direction for direction in DIRECTIONS}
    summary = reader.get_summary()
    if summary is None:
        raise EndOfFile("it has no summary")
    for channel in summary.channels.values():
        schema = summary.schemas[channel.schema_id]
        if schema.name.startswith(SERIES_PREFIX):
            schemas[channel.topic] = json.loads(schema.data)
            rows[channel.topic] = []
    # By log time; messages of one time keep the order in which they were written.
    for _, channel, message in reader.iter_messages():
        body = json.loads(message.data)
        if channel.topic in directions:
            wire.append(WireRecord(body["t"], directions[channel.topic], bytes.fromhex(body["hex"])))
        elif channel.topic == "/events":
            events.append(Event(body["t"], severities[body["level"]], body["message"]))
        else:
            rows[channel.topic].append(body)
    series = {topic[1:]: _read_series(schema, rows[topic]) for topic, schema in schemas.items()}
    return Recording(header, series, tuple(wire), tuple(events))


def _write_series(writer: Writer, name: str, series: Series) -> None:
    properties = {"t": {**NUMBER, "unit": "s"}}
    properties |= {c: {**NUMBER, "unit": u} for c, u in zip(series.columns, series.units, strict=True)}
    channel = _channel(writer, f"/{name}", SERIES_PREFIX + name, {"type": "object", "properties": properties})
    for t, row in zip(series.times.tolist(), series.values.tolist(), strict=True):
        _add(writer, channel, t, dict(zip(series.columns, row, strict=True)))


def _read_series(schema: dict[str, Any], rows: list[dict[str, Any]]) -> Series:
    units = {name: spec["unit"] for name, spec in schema["properties"].items() if name != "t"}
    values = np.array([[row[name] for name in units] for row in rows], float).reshape(len(rows), len(units))
    return Series(tuple(units), tuple(units.values()), np.array([row["t"] for row in rows], float), values)


def _channel(writer: Writer, topic: str, schema_name: str, schema: dict[str, Any]) -> int:
    schema_id = writer.register_schema(schema_name, "jsonschema", json.dumps(schema).encode())
    return writer.register_channel(topic, "json", schema_id)


def _add(writer: Writer, channel: int, t: float, body: dict[str, Any]) -> None:
    time = _nanoseconds(t)
    writer.add_message(channel, time, json.dumps({"t": t, **body}).encode(), time)


def _nanoseconds(t: float) -> int:
    return round(t * 1e9)
