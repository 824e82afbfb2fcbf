"""Playback of a recording's position commands as angles."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from aero.actuation import ActuationMap
from hil.recordings.errors import UnusableFileError
from hil.recordings.mcap_file import read_recording
from hil.recordings.wire_file import with_series
from lerobot_robot_aero.angles import AngleMap


@dataclass(frozen=True)
class Playback:
    """Angles over time, each valid until the next."""

    times: NDArray[np.float64]
    """Times, (n,) float, s; the first is 0."""
    degrees: NDArray[np.float64]
    """Angles, (n, 7) float, degrees, command order."""
    duration_s: float
    """Time from the first command to the end of the recording, s."""

    def at(self, t: float, *, repeat: bool) -> NDArray[np.float64]:
        """Return the angles (7,), degrees, `t` s after the start; after the end repeat, or hold the last ones."""
        if repeat and self.duration_s > 0:
            t %= self.duration_s
        held: NDArray[np.float64] = self.degrees[max(0, int(np.searchsorted(self.times, t, side="right")) - 1)]
        return held


def load_playback(path: Path) -> Playback:
    """Return the position commands of a recording, parsed from the bytes sent to its hand.

    Raises:
        OSError: the file cannot be read.
        UnusableFileError: the file is not a recording of aero-hil, or has no position command.
    """
    recording = with_series(read_recording(path))
    if "command_codes" not in recording.series:
        raise UnusableFileError(f"{path} holds no position command to the hand, so there is nothing to play")
    commands, header = recording["command_codes"], recording.header
    codec = ActuationMap.for_firmware(header.firmware, header.window, side=header.side)
    first, last = commands.times[[0, -1]].tolist()
    return Playback(
        times=commands.times - first,
        degrees=AngleMap(codec).degrees(commands.values.astype(np.int64)),
        duration_s=max(last, header.duration_s) - first,  # 0 in the header of an aborted recording
    )
