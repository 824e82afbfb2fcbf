"""LeRobot's own commands as lerobot_robot_aero/lerobot.md shows them, in real time, on emulated hands."""

import re
import shutil
import signal
import subprocess
import sys

import numpy as np
import pytest
from lerobot.datasets import LeRobotDataset
from lerobot_robot_aero.angles import CURRENTS, POSITIONS
from page_commands import OPENED, PAGE, PATIENCE_S, begun, done, wait_for

from aero import AeroHand, WallClock
from aero.protocol import MAX_CODE
from aero.safety import Thresholds
from hil.emulated.emulated_spec import EmulatedSpec
from hil.emulated.pty_process import serve_in_child

pytestmark = pytest.mark.slow

FPS, EPISODE_S = 30, 3.0
FEWEST = 0.5
"""Share of the frames that a busy machine still takes; a quiet one takes all but one in twenty."""


def shorter(*, episodes):
    return f"--dataset.num_episodes={episodes}", f"--dataset.episode_time_s={EPISODE_S}", "--dataset.reset_time_s=0.5"


@pytest.fixture(scope="module")
def folder(tmp_path_factory, recording):
    """Return a folder with the recording that the page plays, and the data set of two episodes that it records."""
    path = tmp_path_factory.mktemp("page")
    shutil.copy(recording, path / "motion.mcap")
    done(begun("lerobot-record", path, *shorter(episodes=2)))
    return path


def test_a_recorded_data_set_is_read_by_lerobots_loader(folder):
    found = LeRobotDataset("me/turning", root=folder / "turning")
    assert (found.num_episodes, found.fps, found.meta.robot_type) == (2, FPS, "aero_hand")
    assert found.features["action"]["names"] == [*POSITIONS]
    assert found.features["observation.state"]["names"] == [*POSITIONS, *CURRENTS]
    assert 2 * FPS * EPISODE_S * FEWEST <= found.num_frames <= 2 * FPS * EPISODE_S + 2
    actions = np.array([row.numpy() for row in found.select_columns("action")["action"]])
    states = np.array([row.numpy() for row in found.select_columns("observation.state")["observation.state"]])
    # The index is commanded to 40000 of 65535, 55 degrees, in each episode, and goes there.
    assert actions[:, 0].max() == pytest.approx(54.9, abs=0.5)
    assert states[:, 0].max() == pytest.approx(54.9, abs=5.0)


def test_the_python_of_the_page_reads_it(folder):
    (snippet,) = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.S)
    ran = subprocess.run(
        [sys.executable, "-c", snippet], cwd=folder, capture_output=True, text=True, timeout=PATIENCE_S, check=True
    )
    episodes, frames, fps = map(int, ran.stdout.splitlines()[0].split())
    assert (episodes, fps) == (2, FPS)
    assert frames > 0
    assert POSITIONS[0] in ran.stdout.splitlines()[1]


def test_an_episode_is_replayed(folder):
    assert OPENED in done(begun("lerobot-replay", folder))


def test_a_hand_follows_another(tmp_path):
    said = done(begun("lerobot-teleoperate", tmp_path, "--teleop.unit=plausible:1", "--fps=30", "--teleop_time_s=3"))
    assert "following right hand on pty" in said
    assert len(re.findall("Teleop loop time", said)) > 3.0 * 30 * FEWEST
    assert OPENED in said


def test_lerobot_calibrate_homes_the_hand(tmp_path):
    assert OPENED in done(begun("lerobot-calibrate", tmp_path))


def test_ctrl_c_in_an_episode_leaves_the_hand_open_and_the_data_set_readable(tmp_path, recording):
    shutil.copy(recording, tmp_path / "motion.mcap")
    clock = WallClock()
    with serve_in_child(EmulatedSpec()) as (port, _):
        process = begun("lerobot-record", tmp_path, *shorter(episodes=9), f"--robot.port={port}")
        try:
            wait_for(process, "Recording episode 1")
            with pytest.raises(subprocess.TimeoutExpired):
                process.wait(EPISODE_S / 2)
            process.send_signal(signal.SIGINT)
            said, _ = process.communicate(timeout=PATIENCE_S)
        finally:
            process.kill()
        assert process.returncode != 0
        assert OPENED in said, said[-4000:]
        with AeroHand.open_unguarded(port) as hand:
            clock.sleep_until(clock.now() + 0.1)
            assert hand.read_codes().max() < Thresholds.arrival * MAX_CODE
    found = LeRobotDataset("me/turning", root=tmp_path / "turning")
    assert found.num_episodes == 1
    assert found.num_frames == len(found.select_columns("action")["action"]) >= FPS * EPISODE_S * FEWEST
