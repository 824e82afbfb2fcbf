"""Black box of a guarded port: the bytes of the last minutes, written to a file at each stop."""

from collections import deque
from collections.abc import Iterator
from datetime import datetime
from pathlib import Path
from typing import Any

from aero.actuation import ActuationMap
from aero.clock import Clock
from aero.firmware import DEFAULT_FIRMWARE
from aero.side import Side
from hil.recordings.mcap_file import write_recording
from hil.recordings.output import prepared_folder
from hil.recordings.provenance import local_time, origin
from hil.recordings.recording import Event, Header, Recording
from hil.recordings.wire_file import SESSION
from hil.targets.wire_log import WireRecord

KEPT_S = 180.0
"""Time before a stop that is written, s."""


class BlackBox:
    """Bytes between a guard and a hand, of the last `KEPT_S`."""

    def __init__(
        self, folder: Path, clock: Clock, *, target: str, unit: str, hand_id: str = "",
        firmware: str = DEFAULT_FIRMWARE, side: Side = "right",
    ) -> None:  # fmt: skip
        """Start empty; nothing is written before the first stop.

        Args:
            folder: folder of the files, created with the first one.
            clock: clock of the hand.
            target: name of the hand's port.
            unit: unit of the hand.
            hand_id: name of the individual hand.
            firmware: firmware version of the hand.
            side: side of the hand.
        """
        codec = ActuationMap.for_firmware(firmware, side=side)
        self._folder, self._clock = folder, clock
        self._records: deque[WireRecord] = deque()
        self._about: dict[str, Any] = {
            "experiment": SESSION, "target": target, "side": side, "firmware": firmware, "unit": unit, "seed": 0,
            "map": codec.coefficients.name, "window": codec.window.name, "hand_id": hand_id,
        }  # fmt: skip

    def add(self, to_hand: bool, data: bytes) -> None:
        """Keep bytes that cross the port now."""
        now = self._clock.now()
        self._records.append(WireRecord(now, "to_hand" if to_hand else "from_hand", data))
        while self._records[0].t < now - KEPT_S:
            self._records.popleft()

    def taken(self, text: str) -> Recording:
        """Return the recording of the last `KEPT_S`, with the reason of the stop as an event now."""
        now = self._clock.now()
        start = self._records[0].t if self._records else now
        kept = tuple(WireRecord(t - start, direction, data) for t, direction, data in self._records)
        about = origin() | {"started": local_time(now - start)}
        header = Header(**self._about, **about, duration_s=now - start)
        return Recording(header, {}, kept, (Event(now - start, "error", text),))

    def write(self, recording: Recording) -> Path:
        """Write a recording of `taken` under a new name, and return its path.

        Raises:
            OSError, CannotBeWrittenError: the file cannot be written.
        """
        prepared_folder(self._folder)
        path = next(path for path in self._names() if not path.exists())
        write_recording(recording, path)
        return path

    def _names(self) -> Iterator[Path]:
        stamp = datetime.now().astimezone().strftime("stop-%Y-%m-%dT%H-%M-%S")
        yield self._folder / f"{stamp}.mcap"
        yield from (self._folder / f"{stamp}-{number}.mcap" for number in range(1, 1000))
