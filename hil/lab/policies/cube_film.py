"""A film of a policy that turns a cube, as a GIF."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PIL import Image

from aero.whole_file import whole
from hil.lab.policies.cube_watch import CubeWatch
from model.film import frames
from model.geometry import Side

FRAMES_PER_S = 10.0
"""Half the control periods, which is enough to follow and half the file."""
COLOURS = 64
"""Of the palette that all frames share, so that what stands still does not flicker."""


def write_film(watch: CubeWatch, side: Side, path: Path, period_s: float) -> None:
    """Draw what was watched, in the time it took, to a GIF file.

    Args:
        watch: of a trial with at least one control period.
        side: of the hand.
        path: of the file.
        period_s: between two of the watched postures.
    """
    every = max(1, round(1.0 / (FRAMES_PER_S * period_s)))
    drawn = [Image.fromarray(picture) for picture in frames(np.array(watch.postures)[::every], side)]
    palette = drawn[len(drawn) // 2].quantize(COLOURS, dither=Image.Dither.NONE)
    first, *others = (one.quantize(palette=palette, dither=Image.Dither.NONE) for one in drawn)
    with whole(path) as draft:
        first.save(draft, save_all=True, append_images=others, duration=round(1e3 * every * period_s), loop=0)
