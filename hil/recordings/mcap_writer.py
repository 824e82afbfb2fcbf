"""Writing MCAP files of many small messages: byte for byte what `mcap.writer.Writer` writes, at a fifth of the cost.

That writer makes an object and a dozen calls of each message and of each entry of an index. Here a message is one
`struct` and one entry of a list; a chunk is put together when it is full. Everything else in the file is written by the
library's own records. Source: the MCAP specification (https://mcap.dev/spec), records 0x05 and 0x07.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import BinaryIO

from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    McapRecord,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)
from mcap.writer import MCAP0_MAGIC
from zstandard import ZstdCompressor

Messages = Iterable[tuple[int, int, bytes]]
"""Channel, log time (ns) and content of each."""

_MESSAGE = struct.Struct("<BQHIQQ")
"""Opcode, length of the rest, channel, sequence, log time, publish time."""
_HEAD = struct.calcsize("<HIQQ")
"""Of a message, counted in its length, bytes."""
_INDEX = struct.Struct("<BQHI")
"""Opcode, length of the rest, channel, bytes of the entries."""
_FOOTER_START = struct.Struct("<BQQQ")
"""Opcode, length of the rest, start of the summary, start of its offsets: what its checksum covers of the footer."""
_FOOTER_SIZE = 20


class McapWriter:
    """One file in the making: chunks with an index of their messages, a summary at the end."""

    def __init__(self, stream: BinaryIO, library: str, chunk_bytes: int) -> None:
        """Begin the file.

        Args:
            stream: what is written to; left open at the end.
            library: name of the program that writes.
            chunk_bytes: of messages, above which they are compressed together.
        """
        self._stream = stream
        self._chunk_bytes = chunk_bytes
        self._compress: Callable[[bytes], bytes] = ZstdCompressor().compress
        self._schemas: list[McapRecord] = []
        self._channels: list[McapRecord] = []
        self._metadata: list[McapRecord] = []
        self._chunks: list[McapRecord] = []
        self._counts: dict[int, int] = {}
        self._first_ns = self._last_ns = 0
        self._parts: list[bytes] = []
        self._size = 0
        self._entries: dict[int, list[int]] = {}
        """Of the present chunk: channel to log time and place of each message, in turn."""
        stream.write(MCAP0_MAGIC)
        self._put(Header("", library))

    def add_metadata(self, name: str, content: Mapping[str, str]) -> None:
        """Write a metadata record, in front of the chunk that is being put together."""
        start = self._stream.tell()
        length = self._put(Metadata(name, dict(content)))
        self._metadata.append(MetadataIndex(start, length, name))

    def register_schema(self, name: str, encoding: str, data: bytes) -> int:
        """Make a schema known; return its number."""
        schema = Schema(len(self._schemas) + 1, data, encoding, name)
        self._schemas.append(schema)
        self._add_part(_bytes_of([schema]))
        return schema.id

    def register_channel(self, topic: str, encoding: str, schema: int) -> int:
        """Make a channel known; return its number."""
        channel = Channel(len(self._channels) + 1, topic, encoding, {}, schema)
        self._channels.append(channel)
        self._add_part(_bytes_of([channel]))
        return channel.id

    def add_messages(self, messages: Messages) -> None:
        """Write messages in this order."""
        for channel, time, content in messages:
            entries = self._entries.get(channel)
            if entries is None:
                entries = self._entries[channel] = []
            entries += time, self._size
            length = _HEAD + len(content)
            self._parts.append(_MESSAGE.pack(Opcode.MESSAGE, length, channel, 0, time, time))
            self._add_part(content, _MESSAGE.size + len(content))

    def finish(self) -> None:
        """Write the summary that readers need to jump about."""
        self._end_chunk()
        self._put(DataEnd(0))
        start = self._stream.tell()
        groups: tuple[tuple[Opcode, Sequence[McapRecord]], ...] = (
            (Opcode.SCHEMA, self._schemas),
            (Opcode.CHANNEL, self._channels),
            (Opcode.STATISTICS, [self._statistics()]),
            (Opcode.CHUNK_INDEX, self._chunks),
            (Opcode.ATTACHMENT_INDEX, []),  # the library's writer has this empty group too
            (Opcode.METADATA_INDEX, self._metadata),
        )
        summary, offsets = b"", list[McapRecord]()
        for opcode, records in groups:
            group = _bytes_of(records)
            offsets.append(SummaryOffset(opcode, start + len(summary), len(group)))
            summary += group
        offset_start = start + len(summary)
        summary += _bytes_of(offsets)
        covered = _FOOTER_START.pack(Opcode.FOOTER, _FOOTER_SIZE, start, offset_start)
        self._stream.write(summary)
        self._put(Footer(start, offset_start, zlib.crc32(covered, zlib.crc32(summary))))
        self._stream.write(MCAP0_MAGIC)

    def _add_part(self, part: bytes, size: int = 0) -> None:
        self._parts.append(part)
        self._size += size or len(part)
        if self._size > self._chunk_bytes:
            self._end_chunk()

    def _end_chunk(self) -> None:
        """Write the chunk that was put together, and the index of each of its channels."""
        if not self._entries:
            return
        data = b"".join(self._parts)
        times = [time for entries in self._entries.values() for time in entries[::2]]
        first, last = min(times), max(times)
        self._first_ns = min(self._first_ns, first) if self._counts else first
        self._last_ns = max(self._last_ns, last)
        packed = self._compress(data)
        start = self._stream.tell()
        length = self._put(Chunk("zstd", packed, last, first, zlib.crc32(data), len(data)))
        places, index = {}, b""
        for channel, entries in self._entries.items():
            places[channel] = start + length + len(index)
            self._counts[channel] = self._counts.get(channel, 0) + len(entries) // 2
            rows = struct.pack(f"<{len(entries)}Q", *entries)
            index += _INDEX.pack(Opcode.MESSAGE_INDEX, len(rows) + 6, channel, len(rows)) + rows
        self._stream.write(index)
        self._chunks.append(ChunkIndex(length, start, "zstd", len(packed), last, len(index), places, first, len(data)))
        self._parts, self._size, self._entries = [], 0, {}

    def _statistics(self) -> Statistics:
        return Statistics(
            attachment_count=0,
            channel_count=len(self._channels),
            channel_message_counts=self._counts,
            chunk_count=len(self._chunks),
            message_count=sum(self._counts.values()),
            message_end_time=self._last_ns,
            message_start_time=self._first_ns,
            metadata_count=len(self._metadata),
            schema_count=len(self._schemas),
        )

    def _put(self, record: McapRecord) -> int:
        return self._stream.write(_bytes_of([record]))


def _bytes_of(records: Iterable[McapRecord]) -> bytes:
    builder = RecordBuilder()
    for record in records:
        record.write(builder)
    return bytes(builder.end())  # type: ignore[no-untyped-call]  # mcap leaves this one unannotated
