"""Pictures: drawn only where an OpenGL backend is named."""

from __future__ import annotations

import os

import numpy as np
import pytest

from model import build_routed
from model.__main__ import main
from model.render import HEIGHT, WIDTH, picture

pytestmark = pytest.mark.skipif(
    "MUJOCO_GL" not in os.environ, reason="set MUJOCO_GL=egl (or osmesa, glfw) to draw with that OpenGL"
)


def test_the_left_hand_looks_like_the_right_one_in_a_mirror():
    right, left = (picture(build_routed(side), side).astype(int) for side in ("right", "left"))
    assert right.shape == (HEIGHT, WIDTH, 3)
    red_cables = (right[..., 0] > 180) & (right[..., 1] < 80) & (right[..., 2] < 80)
    assert red_cables.sum() > 300
    different = np.abs(right - left[:, ::-1]).max(axis=2) > 40
    assert different.mean() < 0.01
    assert (np.abs(right - left).max(axis=2) > 40).mean() > 0.02


def test_render_writes_a_png(tmp_path):
    path = tmp_path / "hand.png"
    main(["render", "--out", str(path)])
    assert path.read_bytes().startswith(b"\x89PNG")
