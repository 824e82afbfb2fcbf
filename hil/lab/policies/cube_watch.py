"""A cube in an emulated hand while a policy runs: where it is put, how far it turns, when it is lost; a film of it."""

from __future__ import annotations

from math import nan
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from aero.whole_file import whole
from model.cube_plant import CubePlant
from model.film import frames
from model.geometry import Side
from model.scene import CUBE_START

LOST_HEIGHT = -0.05
"""Height of the cube's centre below which it is lost, world frame, m; as in training."""
SETTLING_S = 0.5
"""How long a cube that is put in may bounce, s; as in training."""
GAP_M = 0.0005
"""Distance from which a cube that is not touched counts as let go, m. A cube that rests on fingers that move is without
any contact at 1 to 3 % of single instants, with gaps of 0.1 mm in the median; nobody sees those."""
PLACING_SPREAD_M = 0.002
"""Standard deviation of where a person puts the cube, along each axis, m."""


class CubeWatch:
    """Puts the cube into the hand and follows it until it is lost."""

    def __init__(self, plant: CubePlant, seed: int) -> None:
        """Watch the cube of `plant`; where it is put is drawn from `seed`."""
        self._plant = plant
        spread = PLACING_SPREAD_M * np.random.default_rng(seed).standard_normal(3)
        self._position = np.array(CUBE_START) + spread
        self._began = 0.0
        self.alive_s = 0.0
        """Time until now or until the loss, s."""
        self.rotation_rad = 0.0
        """Rotation about the vertical in that time, rad."""
        self.lost = False
        """Whether it has fallen."""
        self._looks = self._untouched = self._let_go = 0
        self.postures: list[NDArray[np.float64]] = []
        """Posture of hand and cube at the end of each control period, for `model.film.frames`."""

    def place(self) -> None:
        """Put the cube at rest into the hand; its time begins."""
        self._plant.place_cube(self._position)
        self._began = self._plant.time

    def look(self) -> None:
        """Look at the cube after a control period."""
        self.postures.append(self._plant.posture())
        if not self.lost:
            self.alive_s = self._plant.time - self._began
            self.rotation_rad = self._plant.cube_rotation
            self.lost = bool(self._plant.cube_position()[2] < LOST_HEIGHT)
            if self.alive_s > SETTLING_S:
                self._looks += 1
                if not self._plant.cube_touched():
                    self._untouched += 1
                    self._let_go += self._plant.cube_clear(GAP_M)

    @property
    def airborne(self) -> float:
        """Share of the looks at which nothing touched the cube, once it had settled; NaN before."""
        return self._untouched / self._looks if self._looks else nan

    @property
    def let_go(self) -> float:
        """Share of the looks at which nothing was within `GAP_M` of the cube, once it had settled; NaN before."""
        return self._let_go / self._looks if self._looks else nan

    @property
    def rate_rad_s(self) -> float:
        """Mean angular velocity, rad/s; zero before the first control period."""
        return self.rotation_rad / self.alive_s if self.alive_s else 0.0


FRAMES_PER_S = 10.0
"""Half the control periods, which is enough to follow and half the file."""
COLOURS = 64
"""Colours of the palette that all frames share, so that what stands still does not flicker."""


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
