"""Pictures of an evaluation: rate and survival against delay, and a video of one episode."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from aero.whole_file import whole
from model.film import check_drawing, frames
from train.evaluation.rollouts import Episodes
from train.simulator import Floats

FRAMES_PER_S = 20


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
    with whole(path) as draft:
        figure.savefig(draft, dpi=120)


def check_video() -> None:
    """Try what a video needs, before any work.

    Raises:
        ValueError: the extra `train` is not installed, or nothing can be drawn here.
    """
    if find_spec("imageio") is None:
        raise ValueError("--video needs the extra `train`")
    check_drawing("--video")


def video(rows: Floats, path: Path) -> None:
    """Write positions (steps, 23) as an MP4 at `FRAMES_PER_S`. Needs OpenGL; without a display set `MUJOCO_GL=egl`."""
    import imageio.v3 as imageio  # noqa: PLC0415 - only videos need it

    imageio.imwrite(path, np.array(list(frames(rows))), fps=FRAMES_PER_S)
