"""A film of an emulated hand that turned a cube, drawn after the run."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PIL import Image

from aero.whole_file import whole
from hil.recordings.output import prepared_file
from model.cube_plant import CubeWatch
from model.geometry import Side
from model.pictures import check_drawing, frames

FRAMES_PER_S = 10.0
"""Half the control periods, which is enough to follow and half the file."""
COLOURS = 64
"""Colours of the palette that all frames share, so that what does not move does not flicker."""


def check_film(path: Path, *, holds_cube: bool) -> None:
    """Refuse a film that could not be drawn or written, before anything moves.

    Raises:
        ValueError: no emulated hand with a cube, another kind of file, or no OpenGL.
        OSError: the place cannot be written to.
    """
    if not holds_cube:
        raise ValueError("--film draws an emulated hand and its cube; use it with `--hil emulated`")
    if path.suffix != ".gif":
        raise ValueError(f"--film writes a GIF; name the file .gif, not {path.name}")
    prepared_file(path)
    check_drawing("--film")


def write_film(watch: CubeWatch, side: Side, path: Path, period_s: float) -> None:
    """Draw the postures that were seen, `period_s` apart, in the time they took, to a GIF file."""
    every = max(1, round(1.0 / (FRAMES_PER_S * period_s)))
    drawn = [Image.fromarray(picture) for picture in frames(np.array(watch.postures)[::every], side)]
    palette = drawn[len(drawn) // 2].quantize(COLOURS, dither=Image.Dither.NONE)
    first, *others = (one.quantize(palette=palette, dither=Image.Dither.NONE) for one in drawn)
    with whole(path) as draft:
        first.save(draft, save_all=True, append_images=others, duration=round(1e3 * every * period_s), loop=0)
