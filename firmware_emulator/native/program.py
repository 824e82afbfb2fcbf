"""A compiled firmware as a child process, and the conversation with it; `host/wire.h` is the other side.

Each turn the kernel says what time it is and what has arrived, and the program answers with what it sent and until when
all its tasks wait. The program has no clock of its own, so a run is a pure function of what it is told.
"""

from __future__ import annotations

import os
import select
import signal
import struct
import subprocess
import tempfile
import weakref
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import IO, NamedTuple

RESPONSE_TIMEOUT_S = 10.0
"""Real time after which a program that neither waits nor polls is given up, s; a turn takes less than a millisecond."""

LONGEST_MESSAGE = 20_000
"""How much of what a program printed is shown when it ends, bytes."""

HOST, SERVOS, STORE, FORGET, CAUSE, READY, RESET, FAILED = (ord(letter) for letter in "HUNXCSRE")
"""Kinds of records: bytes of the host's port and of the servo UART, a stored number and one taken away, the cause of
the reset, the end of `setup`, a restart that the firmware asks for, and a message that explains an end."""
_LENGTH = struct.Struct("<I")
_TIME = struct.Struct("<q")
_RECORD = struct.Struct("<BI")
_HEAD = struct.Struct("<Iq")

Record = tuple[int, bytes]


class FirmwareProgramError(Exception):
    """A firmware program ended, failed or hangs; the message carries what it said."""

    exit_code = 6  # `Exit.FIRMWARE` of aero, which this package does not know


class Turn(NamedTuple):
    """What a program did at one instant."""

    wake_ms: int
    """When one of its tasks wants to go on, ms on its own clock; -1 for never."""
    records: list[Record]


class Program:
    """One run of a program, from a reset to the next."""

    def __init__(self, path: Path, *, cause: int, stored: Iterable[tuple[str, int]]) -> None:
        """Start the program; nothing of it runs before the first `turn`.

        Args:
            path: what `aero-hil firmware build` made.
            cause: reset reason, as `esp_reset_reason` counts them.
            stored: the storage's numbers, by `namespace/key`.

        Raises:
            FirmwareProgramError: it cannot be started.
        """
        self.path = path
        # A file, not a pipe: a program that prints a lot must not wait for a reader.
        self._said = tempfile.TemporaryFile()  # noqa: SIM115 - closed with the process
        self._first: list[Record] = [(CAUSE, bytes((cause,)))]
        self._first += [(STORE, f"{name}={value}".encode()) for name, value in stored]
        try:
            self._process = subprocess.Popen(
                [path.resolve()], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._said, bufsize=0
            )
        except OSError as error:
            raise FirmwareProgramError(
                f"cannot run the firmware program {path}: {error}; make one with `aero-hil firmware build`"
            ) from error
        self._buffer = b""
        self._close = weakref.finalize(self, _end, self._process, self._said)

    def close(self) -> None:
        """End the program; a second call does nothing."""
        self._close()

    def turn(self, now_ns: int, records: Sequence[Record] = ()) -> Turn:
        """Tell the time (ns on the program's clock) and what arrived; return what the program did.

        Raises:
            FirmwareProgramError: it ended, failed, or did not answer.
        """
        if self._first:
            records, self._first = [*self._first, *records], []
        payload = _TIME.pack(now_ns) + b"".join(_RECORD.pack(kind, len(data)) + data for kind, data in records)
        stdin = self._process.stdin
        assert stdin is not None
        try:
            stdin.write(_LENGTH.pack(len(payload)) + payload)
        except BrokenPipeError:
            raise self._ended() from None
        return self._answer()

    def _answer(self) -> Turn:
        length, wake_ms = _HEAD.unpack(self._take(_HEAD.size))
        data = self._take(length - _TIME.size)
        records = []
        at = 0
        while at < len(data):
            kind, size = _RECORD.unpack_from(data, at)
            at += _RECORD.size
            records.append((kind, data[at : at + size]))
            at += size
            if kind == FAILED:
                raise FirmwareProgramError(f"{self.path.name}: {records[-1][1].decode(errors='replace')}")
        return Turn(wake_ms, records)

    def _take(self, count: int) -> bytes:
        stdout = self._process.stdout
        assert stdout is not None
        while len(self._buffer) < count:
            ready, _, _ = select.select([stdout], [], [], RESPONSE_TIMEOUT_S)
            if not ready:
                raise self._hanging()
            more = os.read(stdout.fileno(), 65536)
            if not more:
                raise self._ended()
            self._buffer += more
        taken, self._buffer = self._buffer[:count], self._buffer[count:]
        return taken

    def _ended(self) -> FirmwareProgramError:
        status = self._process.wait()
        said = self._messages()
        how = f"was killed by {signal.Signals(-status).name}" if status < 0 else f"ended with status {status}"
        return FirmwareProgramError(f"{self.path.name} {how}: {said or 'it said nothing'}")

    def _hanging(self) -> FirmwareProgramError:
        self._process.send_signal(signal.SIGUSR1)
        # The program explains itself and ends.
        try:
            self._process.wait(1.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
        said = self._messages()
        self.close()
        return FirmwareProgramError(
            f"{self.path.name} has not answered for {RESPONSE_TIMEOUT_S:g} s: {said or 'it does not say why'}. "
            "A loop on the chip would starve its watchdog; let it wait with vTaskDelay(1)."
        )

    def _messages(self) -> str:
        self._said.seek(0)
        return self._said.read()[-LONGEST_MESSAGE:].decode(errors="replace").strip()


def _end(process: subprocess.Popen[bytes], said: IO[bytes]) -> None:
    # The program ends when nobody talks to it any more, and writes what it counted for gcov.
    if process.stdin is not None:
        process.stdin.close()
    try:
        process.wait(1.0)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
    for stream in (process.stdout, said):
        if stream is not None:
            stream.close()
