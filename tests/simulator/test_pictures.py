"""Pictures and films: drawn only where an OpenGL backend is named."""

import os
from dataclasses import replace

import mujoco
import numpy as np
import pytest
from click.testing import CliRunner
from PIL import Image
from policies import holding

from aero.policy.file import save
from hil.cli import main
from hil.recordings.mcap_file import read_recording, write_recording
from hil.report.film import _landed
from model.cube_plant import CubePlant
from simulator import build_routed
from simulator.pictures import (
    FILM_HEIGHT,
    FILM_WIDTH,
    HEIGHT,
    STICKERS,
    WIDTH,
    add_stickers,
    frames,
    picture,
    write_picture,
)
from simulator.scene import Cube, add_cube

drawn = pytest.mark.skipif(
    os.environ.get("MUJOCO_GL") not in {"egl", "osmesa", "glfw"}, reason="drawing needs OpenGL: set MUJOCO_GL=egl"
)


@pytest.mark.parametrize("cube", [Cube(), Cube(side_m=0.055)])
def test_every_face_of_the_cube_has_a_colour_of_its_own(cube):
    spec = mujoco.MjSpec()
    add_stickers(add_cube(spec, cube), cube)
    model = spec.compile()
    np.testing.assert_allclose(np.abs(model.site_pos).max(axis=1), cube.side_m / 2)
    assert len({tuple(np.sign(face).round(6)) for face in model.site_pos}) == 6
    assert len({tuple(colour) for colour in model.site_rgba}) == 6


def fraction_of(picture, colour):
    """Return the fraction of a picture that has about the hue of a sticker."""
    wanted = np.array(STICKERS[colour][:3])
    pixels = picture.reshape(-1, 3) / 255.0
    length = np.linalg.norm(pixels, axis=1)
    return np.mean((pixels @ wanted > 0.985 * length * np.linalg.norm(wanted)) & (np.ptp(pixels, axis=1) > 0.2))


@drawn
def test_a_cube_that_turns_shows_its_next_face():
    plant = CubePlant()
    postures = []
    for angle in (0.0, np.pi):
        plant.place_cube((0.11, 0.0, 0.05), (np.cos(angle / 2), 0.0, 0.0, np.sin(angle / 2)))
        postures.append(plant.posture())
    before, after = frames(np.array(postures))
    assert before.shape == (FILM_HEIGHT, FILM_WIDTH, 3)
    red, orange = (1, 0, 0), (-1, 0, 0)
    assert fraction_of(before, red) > 0.01 > fraction_of(after, red)
    assert fraction_of(after, orange) > 0.01


@pytest.fixture(scope="module")
def turned(tmp_path_factory):
    """A second of a policy with the cube, recorded."""
    folder = tmp_path_factory.mktemp("turned")
    save(holding(), folder / "policy.npz")
    arguments = ["run-policy", str(folder / "policy.npz"), "--seconds", "1", "--record", str(folder / "run.mcap")]
    result = CliRunner().invoke(main, arguments, catch_exceptions=False)
    assert result.exit_code == 0, result.output
    return folder / "run.mcap"


def filmed(recording, path):
    return CliRunner().invoke(main, ["export", str(recording), "--out", str(path)])


@drawn
@pytest.mark.parametrize(("ending", "each_ms"), [("webp", 50), ("gif", 100)])
def test_a_film_is_drawn_of_a_recording_and_needs_no_foxglove(turned, tmp_path, monkeypatch, ending, each_ms):
    monkeypatch.setattr("hil.cli.export.find_spec", lambda _name: None)
    result = filmed(turned, tmp_path / f"film.{ending}")
    assert result.exit_code == 0, result.output
    with Image.open(tmp_path / f"film.{ending}") as film:
        assert film.size == (FILM_WIDTH, FILM_HEIGHT)
        film.load()
        assert film.info["duration"] == each_ms
        assert 0 < film.n_frames <= 1000 // each_ms


def test_a_film_begins_with_the_cube_in_the_hand():
    heights = np.array([0.05, 0.03, -0.01, -0.02, -0.015, -0.016, -0.016, -0.016])
    assert _landed(heights) == 2
    assert _landed(heights[4:]) == 0


@drawn
@pytest.mark.parametrize("side", ["right", "left"])
def test_a_film_frames_the_whole_hand(side):
    """The border of an open and of a closed hand shows the background only."""
    for angle in (0.0, 1.0):
        posture = np.array([angle] * 16 + [0.11, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
        [drawn] = frames(posture[np.newaxis], side)
        border = np.concatenate([drawn[:3].reshape(-1, 3), drawn[-3:].reshape(-1, 3), drawn[:, :3].reshape(-1, 3),
                                 drawn[:, -3:].reshape(-1, 3)]).astype(int)  # fmt: skip
        assert np.ptp(border, axis=0).max() < 40
        assert np.abs(np.diff(drawn[-3:].astype(int), axis=1)).max() < 8


def test_a_film_that_cannot_be_is_refused_in_one_line(turned, tmp_path, monkeypatch):
    def no_context(*_):
        raise RuntimeError("no display")

    monkeypatch.setattr(mujoco, "Renderer", no_context)
    refused = filmed(turned, tmp_path / "film.gif")
    assert (refused.exit_code, refused.output.count("\n")) == (2, 1)
    assert "a film: nothing can be drawn here" in refused.output
    assert list(tmp_path.iterdir()) == []
    monkeypatch.setattr("simulator.pictures.check_drawing", lambda _asked: None)
    recording = read_recording(turned)
    posture = recording["posture"]
    assert posture.values.shape == (20, 23)
    for series in ({}, {"posture": replace(posture, columns=posture.columns[::-1])}):
        write_recording(replace(recording, series=series), tmp_path / "other.mcap")
        refused = filmed(tmp_path / "other.mcap", tmp_path / "film.gif")
        assert (refused.exit_code, refused.output.count("\n")) == (2, 1)
        assert "which this recording does not hold" in refused.output


@drawn
def test_the_left_hand_looks_like_the_right_one_in_a_mirror():
    right, left = (picture(build_routed(side), side).astype(int) for side in ("right", "left"))
    assert right.shape == (HEIGHT, WIDTH, 3)
    red_cables = (right[..., 0] > 180) & (right[..., 1] < 80) & (right[..., 2] < 80)
    assert red_cables.sum() > 300
    different = np.abs(right - left[:, ::-1]).max(axis=2) > 40
    assert different.mean() < 0.01
    assert (np.abs(right - left).max(axis=2) > 40).mean() > 0.02


@drawn
def test_a_picture_is_written_as_png(tmp_path):
    path = tmp_path / "hand.png"
    write_picture(build_routed(), path)
    assert path.read_bytes().startswith(b"\x89PNG")
