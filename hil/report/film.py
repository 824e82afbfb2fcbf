"""Film of an emulated hand turning a cube, rendered from the recording of a policy."""

from pathlib import Path

import numpy as np
from PIL import Image

from aero.whole_file import whole
from hil.recordings.errors import UnusableFileError
from hil.recordings.policy_run import POSTURE
from hil.recordings.recording import Recording
from simulator.pictures import frames

FRAMES_PER_S = 10.0
"""Frame rate of a film, Hz: half the control rate, for half the file size."""
COLOURS = 64
"""Size of the palette, common to all frames so that static parts do not flicker."""


def write_film(recording: Recording, path: Path) -> None:
    """Write a real-time film of hand and cube as a GIF file.

    Raises:
        UnusableFileError: the recording has no cube.
    """
    posture = recording.series.get("posture")
    if posture is None or posture.columns != tuple(POSTURE):
        raise UnusableFileError("a film shows an emulated hand with its cube, which this recording does not hold")
    period_s = float(np.median(np.diff(posture.times))) if len(posture.times) > 1 else 1.0 / FRAMES_PER_S
    every = max(1, round(1.0 / (FRAMES_PER_S * period_s)))
    drawn = [Image.fromarray(picture) for picture in frames(posture.values[::every], recording.header.side)]
    palette = drawn[len(drawn) // 2].quantize(COLOURS, dither=Image.Dither.NONE)
    first, *others = (one.quantize(palette=palette, dither=Image.Dither.NONE) for one in drawn)
    with whole(path) as draft:
        first.save(draft, save_all=True, append_images=others, duration=round(1e3 * every * period_s), loop=0)
