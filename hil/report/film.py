"""Film of an emulated hand turning a cube, rendered from the recording of a policy."""

from pathlib import Path

import numpy as np
from PIL import Image

from aero.floats import Floats
from aero.whole_file import whole
from hil.recordings.errors import UnusableFileError
from hil.recordings.policy_run import POSTURE
from hil.recordings.recording import Recording
from simulator.pictures import frames

GIF_EVERY = 2
"""Control steps to a frame of a GIF, for half its size; WebP shows each step, in full colour."""
COLOURS = 128
"""Size of the palette of a GIF, common to all frames so that static parts do not flicker."""
QUALITY = 70
"""Quality of WebP, 0 to 100: 8 s take 2 MB."""
DROP_M = 0.03
"""Height above its median from which a cube is still in the air, m; half a cube, more than a policy lifts it."""


def write_film(recording: Recording, path: Path) -> None:
    """Write a real-time film of hand and cube as a WebP or GIF file, from the cube's landing in the hand on.

    Raises:
        UnusableFileError: the recording has no cube.
    """
    posture = recording.series.get("posture")
    if posture is None or posture.columns != tuple(POSTURE):
        raise UnusableFileError("a film shows an emulated hand with its cube, which this recording does not hold")
    period_s = float(np.median(np.diff(posture.times))) if len(posture.times) > 1 else 0.05
    gif = path.suffix == ".gif"
    every = GIF_EVERY if gif else 1
    rows = posture.values[_landed(posture.values[:, posture.columns.index("cube_z")]) :: every]
    drawn = [Image.fromarray(picture) for picture in frames(rows, recording.header.side)]
    if gif:
        palette = drawn[len(drawn) // 2].quantize(COLOURS, dither=Image.Dither.NONE)
        drawn = [one.quantize(palette=palette, dither=Image.Dither.NONE) for one in drawn]
    first, *others = drawn
    with whole(path) as draft:
        first.save(
            draft, format=path.suffix[1:], save_all=True, append_images=others, loop=0, quality=QUALITY,
            duration=round(1e3 * every * period_s),
        )  # fmt: skip


def _landed(heights: Floats) -> int:
    """Return the first frame of a cube in the hand, by its heights, m."""
    in_air = heights > np.median(heights) + DROP_M
    return 0 if in_air.all() else int(np.argmin(in_air))
