"""Pictures of an evaluation: rate and survival against delay, and a video of one episode."""

from __future__ import annotations

import warnings
from importlib.util import find_spec
from pathlib import Path

import mujoco
import numpy as np
from matplotlib.figure import Figure

from model.scene import CUBE, add_light
from train.evaluation.rollouts import Episodes
from train.scene import build_scene
from train.simulator import Floats

FRAMES_PER_S = 20
WIDTH, HEIGHT = 640, 480
STICKERS = {
    (1, 0, 0): (0.80, 0.15, 0.15, 1.0),
    (-1, 0, 0): (0.95, 0.55, 0.10, 1.0),
    (0, 1, 0): (0.15, 0.55, 0.25, 1.0),
    (0, -1, 0): (0.15, 0.30, 0.75, 1.0),
    (0, 0, 1): (0.95, 0.95, 0.95, 1.0),
    (0, 0, -1): (0.95, 0.85, 0.15, 1.0),
}
"""Colour on each face, by its outward direction: a turn and its direction can be seen, as on the puzzle."""
STICKER_THICKNESS = 0.2e-3
"""m"""


def delay_picture(delays_s: list[float], episodes: list[Episodes], path: Path) -> None:
    """Draw the rate (mean and quartiles) and the survival against the delay."""
    figure = Figure(figsize=(6, 4.5), layout="constrained")
    rate, survival = figure.subplots(2, 1, sharex=True)
    delays_ms = 1e3 * np.array(delays_s)
    rates = [one.rate_rad_s for one in episodes]
    rate.fill_between(delays_ms, *np.percentile(rates, [25, 75], axis=1), alpha=0.25, linewidth=0, label="quartiles")
    rate.plot(delays_ms, np.mean(rates, axis=1), marker="o", label="mean")
    rate.axhline(0.0, color="black", linewidth=0.6)
    rate.set_ylabel("rate, rad/s")
    rate.legend(frameon=False)
    survival.plot(delays_ms, [one.kept.mean() for one in episodes], marker="o")
    survival.set_ylim(-0.02, 1.02)
    survival.set_ylabel("share that keeps the cube")
    survival.set_xlabel("delay, ms")
    figure.savefig(path, dpi=120)


def add_stickers(spec: mujoco.MjSpec) -> None:
    """Put a coloured square on each face of the cube."""
    for direction, colour in STICKERS.items():
        outward = np.array(direction)
        flat = np.where(outward, STICKER_THICKNESS / 2, 0.4 * CUBE.side_m)
        place = 0.5 * CUBE.side_m * outward
        spec.body("cube").add_site(type=mujoco.mjtGeom.mjGEOM_BOX, size=flat, pos=place, rgba=colour)


def frames(rows: Floats) -> list[np.ndarray]:
    """Render positions (steps, 23), one (HEIGHT, WIDTH, 3) uint8 picture each."""
    spec = build_scene()
    add_light(spec)
    add_stickers(spec)
    model = spec.compile()
    data, camera = mujoco.MjData(model), mujoco.MjvCamera()
    camera.lookat[:] = (0.09, 0.0, 0.02)
    camera.distance, camera.azimuth, camera.elevation = 0.32, 150.0, -40.0
    pictures = []
    with mujoco.Renderer(model, HEIGHT, WIDTH) as renderer:
        for row in rows:
            data.qpos[:] = row
            mujoco.mj_forward(model, data)
            renderer.update_scene(data, camera)
            pictures.append(renderer.render())
    return pictures


def check_video() -> None:
    """Try what a video needs, before any work.

    Raises:
        ValueError: the extra `train` is not installed, or nothing can be drawn here.
    """
    if find_spec("imageio") is None:
        raise ValueError("--video needs the extra `train`")
    try:
        with (
            warnings.catch_warnings(action="ignore"),
            mujoco.Renderer(mujoco.MjModel.from_xml_string("<mujoco/>"), 8, 8),
        ):
            pass
    except Exception as error:  # each OpenGL library has errors of its own
        said = " ".join(str(error).split())
        raise ValueError(f"--video: nothing can be drawn here ({said}); set MUJOCO_GL=egl") from error


def video(rows: Floats, path: Path) -> None:
    """Write positions (steps, 23) as an MP4 at `FRAMES_PER_S`. Needs OpenGL; without a display set `MUJOCO_GL=egl`."""
    import imageio.v3 as imageio  # noqa: PLC0415 - only videos need it

    imageio.imwrite(path, np.array(frames(rows)), fps=FRAMES_PER_S)
