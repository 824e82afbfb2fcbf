"""Calibration's view of a recording: commands, encoder counts, currents and temperatures with their times."""

from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Self

import numpy as np
from numpy.typing import NDArray

from aero.channels import WIRE_ORDER, Channel
from aero.protocol import MAX_CODE
from aero.regular_file import read_npz
from firmware_emulator.firmware.hands import HANDS, SHAFT_OF_SERVO, Side
from hil.recordings.errors import UnusableFileError
from hil.recordings.mcap_file import read_recording
from hil.recordings.recording import Recording


def _by_channel(values: NDArray[np.float64]) -> NDArray[np.float64]:
    ordered = np.empty(len(SHAFT_OF_SERVO))
    ordered[list(SHAFT_OF_SERVO)] = values
    return ordered


def window_counts(side: Side) -> NDArray[np.float64]:
    """Return the width of each channel's command window, (7,) servo counts."""
    config = HANDS[side]
    return _by_channel(np.abs(np.subtract(config.grasp, config.extend, dtype=float)))


def closing_current_sign(side: Side) -> NDArray[np.float64]:
    """Return the sign of the current register, (7,) +1 or -1, while its channel pulls closed.

    Registers are positive toward lower counts (one physical hand, public logs June-July 2026,
    TTdragoAlex/tetherIA-aero-hand-open 58b518e).
    """
    config = HANDS[side]
    return _by_channel(np.sign(np.subtract(config.extend, config.grasp, dtype=float)))


CHANNELS = len(Channel)
OPEN = 0.002
"""Threshold of the command, fraction of the window; at or below it the channel is commanded open."""
SETTLED_S = 0.4
"""Settling time of a channel that is commanded open, s."""
GRID_S = 0.020
"""Common multiple of the telemetry periods of all firmware versions, s."""
NPZ_ARRAYS = frozenset({"t_cmd", "cmd", "t_pos", "pos", "cur_ma", "temp_c", "span_counts"})
"""Arrays of an `.npz` log; further ones, such as names of poses, are ignored."""
LARGEST_BYTES = 128 * 2**20
"""Largest size of an `.npz` log, unpacked: two hours of commands and readings every 20 ms."""


@dataclass(frozen=True)
class Trace:
    """Run of one hand. Arrays over channels are in command order, times in s on the recording's clock."""

    name: str
    t_command: NDArray[np.float64]
    """(n,) times of the position frames."""
    codes: NDArray[np.int64]
    """(n, 7) u16 words of the position frames."""
    t_read: NDArray[np.float64]
    """(m,) times of the position requests."""
    counts: NDArray[np.float64]
    """(m, 7) positions, servo counts from the extended end of the window; 0 also for positions beyond that end."""
    currents: NDArray[np.float64]
    """(m, 7) currents, A, positive while a channel pulls closed; NaN where not read."""
    temperatures: NDArray[np.float64]
    """(m, 7) temperatures, degC; NaN where not read."""
    spans_counts: NDArray[np.float64]
    """(7,) counts of the command window."""
    side: Side = "right"
    firmware: str | None = None
    """Firmware of the recorded hand; None if the file does not name one."""

    def __post_init__(self) -> None:
        n, m = len(self.t_command), len(self.t_read)
        shapes = {
            "codes": (n, CHANNELS),
            "counts": (m, CHANNELS),
            "currents": (m, CHANNELS),
            "temperatures": (m, CHANNELS),
            "spans_counts": (CHANNELS,),
        }
        for field, expected in shapes.items():
            if getattr(self, field).shape != expected:
                raise ValueError(f"{self.name}: {field} must be {expected}, not {getattr(self, field).shape}")
        if n == 0 or m == 0:
            raise ValueError(f"{self.name}: {n} commands and {m} readings; a trace needs both")
        if np.any(np.diff(self.t_command) < 0) or np.any(np.diff(self.t_read) < 0):
            raise ValueError(f"{self.name}: times must not run backwards")

    @property
    def seconds(self) -> float:
        """Duration, s."""
        return float(max(self.t_command[-1], self.t_read[-1]) - min(self.t_command[0], self.t_read[0]))

    def at_rest(self) -> NDArray[np.bool_]:
        """Return a mask of the readings from channels commanded open for at least `SETTLED_S`, (m, 7)."""
        opened = self.codes <= OPEN * MAX_CODE
        # Start of the current open command of each channel, by command; one at the first command counts as settled.
        told = np.where(opened, self.t_command[:, np.newaxis], np.inf)
        begun = np.vstack([np.full(CHANNELS, True), ~opened[:-1]])
        since = np.maximum.accumulate(np.where(opened & begun, told, -np.inf), axis=0)
        since[np.cumsum(~opened, axis=0) == 0] = -np.inf
        latest = np.maximum(np.searchsorted(self.t_command, self.t_read, side="right") - 1, 0)
        rest: NDArray[np.bool_] = opened[latest] & (self.t_read[:, np.newaxis] - since[latest] >= SETTLED_S)
        return rest

    def shortened(self, seconds: float) -> Self:
        """Return the trace with the first motions of each set of channels, at least `seconds` of them if present.

        The trace is cut at starts of motion from rest with all channels open. Times are shifted by whole telemetry
        periods, so that the trace keeps its phase.
        """
        moving = self.codes > OPEN * MAX_CODE
        begins = np.flatnonzero(np.diff(moving.any(axis=1).astype(int), prepend=0) > 0)
        before = np.maximum(np.searchsorted(self.t_read, self.t_command[begins]) - 1, 0)
        cuts = self.t_command[begins[self.at_rest()[before].all(axis=1)]]
        # A read precedes a command of equal time.
        of_command, of_read = np.searchsorted(cuts, self.t_command, side="right"), np.searchsorted(cuts, self.t_read)
        ends = np.array([self.t_command[0], *cuts, self.t_command[-1]])
        kept, shift_s, dropped_s = np.ones(len(cuts) + 1, bool), np.zeros(len(cuts) + 1), 0.0
        spent_s: defaultdict[bytes, float] = defaultdict(float)
        for piece, lasts_s in enumerate(np.diff(ends).tolist()):
            channels = moving[of_command == piece].any(axis=0).tobytes()
            kept[piece] = spent_s[channels] < seconds
            spent_s[channels] += lasts_s
            shift_s[piece] = dropped_s
            dropped_s += 0.0 if kept[piece] else lasts_s // GRID_S * GRID_S
        sent, read = kept[of_command], kept[of_read]
        return replace(
            self,
            t_command=(self.t_command - shift_s[of_command])[sent],
            codes=self.codes[sent],
            t_read=(self.t_read - shift_s[of_read])[read],
            counts=self.counts[read],
            currents=self.currents[read],
            temperatures=self.temperatures[read],
        )

    def beyond(self) -> NDArray[np.bool_]:
        """Return a mask of the readings whose currents show cable tension, (m, 7).

        At rest at the open end, the position reads zero even if a taut cable pulls the shaft beyond the window.
        """
        tells: NDArray[np.bool_] = self.at_rest() & (self.counts == 0.0) & np.isfinite(self.currents)
        return tells

    @classmethod
    def from_npz(cls, path: Path) -> Self:
        """Read an `.npz` log of a right hand in wire order.

        Arrays: `t_cmd` (N,) s and `cmd` (N, 7) 0..1, NaN where nothing was sent; `t_pos` (N,) s and `pos` (N, 7) 0..1,
        NaN where nothing was read; `cur_ma` (N, 7); `temp_c` (N, 7); `span_counts` (7,).

        Raises:
            ValueError: an array is missing or has the wrong shape.
            OSError: no such file.
        """
        try:
            arrays = read_npz(path, LARGEST_BYTES)
            if missing := NPZ_ARRAYS - set(arrays):
                raise ValueError(f"it lacks {', '.join(sorted(missing))}")
            return cls._of_arrays({key: np.asarray(arrays[key], float) for key in NPZ_ARRAYS}, path.stem)
        except (ValueError, TypeError, LookupError) as error:
            raise ValueError(f"{path} is not an .npz log of a hand: {error}") from error

    @classmethod
    def _of_arrays(cls, data: Mapping[str, NDArray[np.float64]], name: str) -> Self:
        wire = [WIRE_ORDER.index(channel) for channel in Channel]
        sent = np.isfinite(data["t_cmd"]) & np.isfinite(data["cmd"]).all(axis=1)
        read = np.isfinite(data["t_pos"]) & np.isfinite(data["pos"]).all(axis=1)
        spans = data["span_counts"][wire]
        return cls(
            name,
            data["t_cmd"][sent],
            np.rint(data["cmd"][sent][:, wire] * MAX_CODE).astype(np.int64),
            data["t_pos"][read],
            np.rint(data["pos"][read][:, wire] * spans),
            data["cur_ma"][read][:, wire] / 1000.0 * closing_current_sign("right"),
            data["temp_c"][read][:, wire],
            spans,
        )

    @classmethod
    def from_recording(cls, recording: Recording, name: str) -> Self:
        """Convert a recording with the series `command_codes` and `codes`.

        The optional series `currents` and `temperatures` contribute the latest sample up to 1 ms after each position.

        Raises:
            KeyError: the recording has no commands or no positions.
        """
        commands, codes = recording["command_codes"], recording["codes"]
        side: Side = "left" if recording.header.side == "left" else "right"
        spans = window_counts(side)

        def at_reads(series: str) -> NDArray[np.float64]:
            if series not in recording.series:
                return np.full(codes.values.shape, np.nan)
            source = recording[series]
            index = np.searchsorted(source.times, codes.times + 1e-3, side="right") - 1
            rows: NDArray[np.float64] = np.where(index[:, None] >= 0, source.values[index], np.nan)
            return rows

        return cls(
            name,
            commands.times,
            np.rint(commands.values).astype(np.int64),
            codes.times,
            np.rint(codes.values * spans / MAX_CODE),
            at_reads("currents") * closing_current_sign(side),
            at_reads("temperatures"),
            spans,
            side,
            recording.header.firmware,
        )


def load_trace(path: Path) -> Trace:
    """Read an `.mcap` recording of this project or an `.npz` log.

    Raises:
        ValueError: neither of the two, or a file that lacks what calibration needs; the message names it.
        OSError: no such file.
    """
    if path.suffix == ".npz":
        return Trace.from_npz(path)
    if path.suffix == ".mcap":
        try:
            return Trace.from_recording(read_recording(path), path.stem)
        except UnusableFileError:
            raise
        except (KeyError, ValueError) as error:
            raise ValueError(f"{path}: {error.args[0]}") from error
    raise ValueError(f"{path}: calibration reads .mcap recordings and .npz logs")
