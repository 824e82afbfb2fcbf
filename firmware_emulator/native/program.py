"""Compiled firmware as a child process, with its protocol; `host/wire.h` implements the program's side.

In each turn the kernel sends the time and the received bytes; the program replies with the transmitted bytes and its
next wake-up time. The program has no clock of its own, so a run is a pure function of its input.
"""

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
"""Time-out of a turn in real time, s; a turn normally takes less than a millisecond."""

LONGEST_MESSAGE = 20_000
"""Size limit of a program's output quoted in error messages, bytes."""

HOST, SERVOS, STORE, FORGET, CAUSE, READY, RESET, FAILED = (ord(letter) for letter in "HUNXCSRE")
"""Record types: bytes of the host port, bytes of the servo UART, number stored, number deleted, reset cause, end of
`setup`, restart requested by the firmware, message about a failure."""
_LENGTH = struct.Struct("<I")
_TIME = struct.Struct("<q")
_RECORD = struct.Struct("<BI")
_HEAD = struct.Struct("<Iq")

Record = tuple[int, bytes]


class FirmwareProgramError(Exception):
    """Firmware program that ended, failed or hangs; the message quotes its output."""

    exit_code = 6  # `Exit.FIRMWARE` of aero, which this package does not know


class Turn(NamedTuple):
    """Output of a program at one instant."""

    wake_ms: int
    """Next wake-up time of a task, ms on the program's clock; -1 for never."""
    records: list[Record]


class Program:
    """Run of a program, from one reset to the next."""

    def __init__(self, path: Path, *, cause: int, stored: Iterable[tuple[str, int]]) -> None:
        """Start the process; the firmware runs from the first `turn`.

        Args:
            path: executable of `aero-hil firmware build`.
            cause: reset reason, as returned by `esp_reset_reason`.
            stored: keys (`namespace/key`) and numbers of the storage.

        Raises:
            FirmwareProgramError: the program cannot be started.
        """
        self.path = path
        # A file, because a program with much output would block on a pipe.
        self._said = tempfile.TemporaryFile()  # noqa: SIM115 - closed with the process
        self._first: list[Record] = [(CAUSE, bytes((cause,)))]
        self._first += [(STORE, f"{name}={value}".encode()) for name, value in stored]
        try:
            self._process = subprocess.Popen(
                [path.resolve()],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=self._said,
                bufsize=0,
                start_new_session=True,  # Ctrl-C in the terminal would end it
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
        """Send the time (ns on the program's clock) and the received records; return the program's output.

        Raises:
            FirmwareProgramError: the program ended, failed or timed out.
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
        return FirmwareProgramError(f"{self.path.name} {how}: {said or 'no output'}")

    def _hanging(self) -> FirmwareProgramError:
        self._process.send_signal(signal.SIGUSR1)
        # On SIGUSR1 the program prints the cause of the hang and exits.
        try:
            self._process.wait(1.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
        said = self._messages()
        self.close()
        return FirmwareProgramError(
            f"{self.path.name} has not answered for {RESPONSE_TIMEOUT_S:g} s: {said or 'no output'}. "
            "A loop on the chip would starve its watchdog; let it wait with vTaskDelay(1)."
        )

    def _messages(self) -> str:
        self._said.seek(0)
        return self._said.read()[-LONGEST_MESSAGE:].decode(errors="replace").strip()


def _end(process: subprocess.Popen[bytes], said: IO[bytes]) -> None:
    # The program exits when its input closes, and then writes its gcov counters.
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
