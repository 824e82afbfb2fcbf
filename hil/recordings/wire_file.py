"""Wire recordings: the bytes between a foreign program and a hand, and the series decoded from them.

`aero-hil emulate --record` and `aero-hil proxy --record` write wire recordings, as the experiment `session` without
series, because the program's intended commands are unknown.
"""

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from aero.actuation import ActuationMap
from aero.clock import Clock
from aero.driver import CURRENT_A_PER_UNIT
from aero.protocol import FILLER, FRAME_SIZE, Opcode, parse_reply, signed_values, unsigned_values
from aero.side import Side
from hil.recordings.errors import CannotBeWrittenError, writing
from hil.recordings.mcap_file import RecordingFile
from hil.recordings.provenance import origin
from hil.recordings.recording import DELAYS, Event, Header, Recording, Series, Severity, delay_series
from hil.recordings.series_layout import LABELS, SERIES_UNITS
from hil.targets.delays import DelayLog
from hil.targets.wire_log import Direction, WireRecord

SESSION = "session"
READ = {"codes": Opcode.GET_POS, "currents": Opcode.GET_CURR, "temperatures": Opcode.GET_TEMP}
"""Series of readings, to the opcode of their replies."""


class WireFile:
    """Writer of a wire recording; bytes to the hand are written as whole frames.

    A write error closes the file and sets `failure`, because recording must not end the link.
    """

    def __init__(
        self,
        path: Path,
        clock: Clock,
        *,
        target: str,
        unit: str,
        firmware: str,
        side: Side,
        seed: int = 0,
        delays: DelayLog | None = None,
        on_failure: Callable[[CannotBeWrittenError], object] = lambda _error: None,
    ) -> None:
        """Create the file.

        Args:
            path: path of the file.
            clock: clock of the recording, whose times count from now.
            target: name of the hand's port.
            unit: unit of the hand.
            firmware: firmware version of the hand.
            side: side of the hand.
            seed: seed of an emulated hand's noise.
            delays: delays of the emulated board, written at the end.
            on_failure: called once, at the first write error.

        Raises:
            CannotBeWrittenError: the file cannot be created.
        """
        codec = ActuationMap.for_firmware(firmware, side=side)
        self._path = path
        self._on_failure = on_failure
        self._delays = delays
        self.failure: CannotBeWrittenError | None = None
        self._clock = clock
        self._start = clock.now()
        self._unfinished = b""
        self._header = Header(
            experiment=SESSION,
            target=target,
            side=side,
            firmware=firmware,
            map=codec.coefficients.name,
            window=codec.window.name,
            unit=unit,
            seed=seed,
            finished=False,
            **origin(),
        )
        with writing(path):
            self._file = RecordingFile(path, self._header)

    def add(self, direction: Direction, data: bytes) -> None:
        """Record bytes that cross the link now; bytes to the hand may be part of a frame, or several frames."""
        t = self._clock.now() - self._start
        if direction == "from_hand":
            self._write(RecordingFile.add_wire, WireRecord(t, direction, data))
            return
        self._unfinished += data
        while len(self._unfinished) >= FRAME_SIZE:
            frame, self._unfinished = self._unfinished[:FRAME_SIZE], self._unfinished[FRAME_SIZE:]
            self._write(RecordingFile.add_wire, WireRecord(t, direction, frame))

    def note(self, text: str, severity: Severity) -> None:
        """Add an event with the present time."""
        self._write(RecordingFile.add_event, Event(self._clock.now() - self._start, severity, text))

    def close(self) -> None:
        """Complete and close the file."""
        duration = self._clock.now() - self._start
        if self._unfinished:
            self._write(RecordingFile.add_wire, WireRecord(duration, "to_hand", self._unfinished))
        if self._delays is not None and (series := delay_series(self._delays.since(self._start))) is not None:
            self._write(RecordingFile.add_whole_series, DELAYS, series)
        self._write(RecordingFile.finish, replace(self._header, duration_s=duration, finished=True))
        self._file.close()

    def _write(self, action: Callable[..., None], *arguments: object) -> None:
        if self.failure is not None:
            return
        try:
            with writing(self._path):
                action(self._file, *arguments)
        except CannotBeWrittenError as error:
            self.failure = error
            self._file.close()
            self._on_failure(error)


def with_series(recording: Recording) -> Recording:
    """Return a wire recording with the commands and readings of its frames as series."""
    rows: dict[str, list[tuple[float, NDArray[np.float64]]]] = {}
    for name, t, words in _frames(recording):
        rows.setdefault(name, []).append((t, words))
    series = {
        name: Series.of(LABELS, SERIES_UNITS[name], [t for t, _ in found], np.array([words for _, words in found]))
        for name, found in rows.items()
    }
    return replace(recording, series=series)


def _frames(recording: Recording) -> Iterator[tuple[str, float, NDArray[np.float64]]]:
    """Yield series name, time and values, (7,), of each frame with commands or readings."""
    name_of = {opcode: name for name, opcode in READ.items()}
    received, asked = b"", -1
    for record in recording.wire:
        if record.direction == "to_hand":
            received, asked = b"", record.data[0]
            if asked == Opcode.CTRL_POS and len(record.data) == FRAME_SIZE:
                yield "command_codes", record.t, unsigned_values(parse_reply(record.data)).astype(float)
            continue
        received += record.data
        if len(received) == FRAME_SIZE and received[:2] == bytes((asked, FILLER)) and asked in name_of:
            yield name_of[Opcode(asked)], record.t, _reading(name_of[Opcode(asked)], received)


def _reading(name: str, frame: bytes) -> NDArray[np.float64]:
    reply = parse_reply(frame)
    if name == "currents":
        return CURRENT_A_PER_UNIT * signed_values(reply).astype(np.float64)
    return unsigned_values(reply).astype(np.float64)
