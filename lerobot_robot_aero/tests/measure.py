"""Measure the figures of lerobot_robot_aero/lerobot.md, in real time.

`PYTHONPATH=docs python lerobot_robot_aero/tests/measure.py FOLDER` runs the page's commands in a folder and stores the
result, `docs/figures/stored/lerobot.commands.json`.
"""

import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import product
from pathlib import Path

import numpy as np
from lerobot.datasets import LeRobotDataset
from lerobot_robot_aero.angles import AngleMap
from page_commands import OPENED, begun, done, wait_for

import hil
from aero import JOINT_BOX_RAD, ActuationMap, AeroHand, Channel
from aero.firmware import DEFAULT_FIRMWARE
from aero.protocol import MAX_CODE
from hil.recordings.mcap_file import read_recording
from hil.recordings.wire_file import with_series

FPS, EPISODES, EPISODE_S, TELEOPERATED_S = 30, 3, 10, 30
PATIENCE_S = 900.0
SEEDS, POSTURES = range(83000, 83004), 5
JOINTS_OF = ((0, 1, 2), (3, 4, 5), (6, 7, 8), (9, 10, 11), (12,), (13,), (14, 15))
"""Joints on the cable of each channel."""


@contextmanager
def served(folder: Path, name: str) -> Iterator[tuple[str, Path]]:
    """Serve an emulated hand in real time; yield its port, and the file that then holds every byte."""
    port, record = folder / f"{name}.port", folder / f"{name}.mcap"
    command = [sys.executable, "-m", "hil.cli", "emulate", "--link", str(port), "--record", str(record)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, start_new_session=True) as server:
        assert server.stdout is not None
        server.stdout.readline()
        try:
            yield str(port), record
        finally:
            server.terminate()


def share_closed(port: str) -> float:
    """Return how far the most closed channel of a hand is closed."""
    with AeroHand.open_unguarded(port) as hand:
        return float(hand.read_codes().max()) / MAX_CODE


def recorded(folder: Path) -> dict[str, str]:
    """Record as the page does, and read the data set."""
    done(begun("lerobot-record", folder), PATIENCE_S)
    found = LeRobotDataset("me/turning", root=folder / "turning")
    frames = [found.meta.episodes[i]["length"] for i in range(found.num_episodes)]
    names = len(found.features["action"]["names"]), len(found.features["observation.state"]["names"])
    return {
        "command": "`lerobot-record`",
        "asked": f"{EPISODES} episodes of {EPISODE_S} s at {FPS} Hz",
        "found": f"{len(frames)} episodes of {', '.join(map(str, frames))} frames, "
        f"{sum(frames) / (EPISODE_S * len(frames)):.1f} a second; {names[0]} actions, {names[1]} observations a frame",
    }


def interrupted(folder: Path, episode: int) -> dict[str, str]:
    """Record as the page does, press Ctrl-C two seconds into an episode, and read what there is."""
    name = f"interrupted-{episode}"
    with served(folder, name) as (port, _):
        process = begun("lerobot-record", folder, f"--robot.port={port}", f"--dataset.root={name}")
        wait_for(process, f"Recording episode {episode}")
        try:
            process.wait(2.0)
        except subprocess.TimeoutExpired:
            process.send_signal(signal.SIGINT)
        said, _ = process.communicate(timeout=PATIENCE_S)
        closed = share_closed(port)
    assert OPENED in said, said[-4000:]
    try:
        found = LeRobotDataset("me/turning", root=folder / name)
        readable = f"{found.num_episodes} episodes can be read, {found.num_frames} frames"
    except Exception as error:
        readable = f"no episode was saved, and LeRobot cannot read the data set ({type(error).__name__})"
    return {
        "command": f"`lerobot-record`, Ctrl-C in episode {episode + 1}",
        "asked": "",
        "found": f"hand open, no channel more than {closed:.1%} closed; {readable}",
    }


def replayed(folder: Path) -> dict[str, str]:
    """Replay the first episode, and compare what went to the hand with what the data set holds."""
    with served(folder, "replayed") as (port, record):
        assert OPENED in done(begun("lerobot-replay", folder, f"--robot.port={port}"), PATIENCE_S)
    found = LeRobotDataset("me/turning", root=folder / "turning", episodes=[0])
    codec = ActuationMap.for_firmware(DEFAULT_FIRMWARE)
    wanted = np.array([AngleMap(codec).codes(row.numpy()) for row in found.select_columns("action")["action"]])
    sent = with_series(read_recording(record))["command_codes"]
    # The guard's own openings come before and after.
    off = [np.abs(sent.values[k : k + len(wanted)] - wanted).max() for k in range(len(sent.times) - len(wanted) + 1)]
    begin = int(np.argmin(off))
    took_s = sent.times[begin + len(wanted) - 1] - sent.times[begin]
    return {
        "command": "`lerobot-replay`",
        "asked": f"{len(wanted)} frames at {FPS} Hz",
        "found": f"{len(wanted)} commands, off by at most {off[begin]:.0f} of 65535, "
        f"{(len(wanted) - 1) / took_s:.1f} a second",
    }


def teleoperated(folder: Path) -> dict[str, str]:
    """Let one emulated hand follow another."""
    said = done(begun("lerobot-teleoperate", folder, f"--fps={FPS}", f"--teleop_time_s={TELEOPERATED_S}"), PATIENCE_S)
    assert OPENED in said
    times_ms = [float(ms) for ms in re.findall(r"Teleop loop time: ([\d.]+)ms", said)]
    return {
        "command": "`lerobot-teleoperate`",
        "asked": f"{TELEOPERATED_S} s at {FPS} Hz",
        "found": f"{len(times_ms) / TELEOPERATED_S:.1f} loops a second, half of them within {np.median(times_ms):.1f} "
        f"ms and 99 of 100 within {np.percentile(times_ms, 99):.0f} ms; no reading lost",
    }


def corrected() -> dict[str, str]:
    """Send drawn hands to drawn postures, with and without their unit files, in virtual time."""
    random = np.random.default_rng(SEEDS[0])
    codec = ActuationMap.for_firmware(DEFAULT_FIRMWARE)
    low, high = np.rad2deg(JOINT_BOX_RAD[[joints[0] for joints in JOINTS_OF]]).T
    postures = low + random.uniform(0.15, 0.75, (POSTURES, len(Channel))) * (high - low)
    errors: dict[bool, list[float]] = {True: [], False: []}
    for seed, known in product(SEEDS, errors):
        unit = f"plausible:{seed}"
        angles = AngleMap.corrected(codec, unit if known else "none")
        with hil.emulate(unit=unit, seed=seed) as target:
            plant = target.truth.plant
            for posture in postures:
                target.hand.command_codes(angles.codes(posture))
                target.clock.sleep_until(target.clock.now() + 1.2)
                joints = np.rad2deg(plant.joint_angles())
                stands = [joints[list(of_cable)].mean() for of_cable in JOINTS_OF]
                errors[known].append(float(np.abs(stands - posture).mean()))
    return {
        "command": "`--robot.correction=mine.toml`",
        "asked": f"{POSTURES} postures of {len(SEEDS)} drawn hands, plausible:{SEEDS[0]} to {SEEDS[-1]}",
        "found": f"joints {np.mean(errors[True]):.1f}° from the action, {np.mean(errors[False]):.1f}° without it",
    }


def main(folder: Path) -> None:
    """Measure everything and print it."""
    command = "aero-hil run-policy --empty --seconds 10 --record motion.mcap"
    subprocess.run([sys.executable, "-m", "hil.cli", *command.split()[1:]], cwd=folder, check=True)
    broken_off = (interrupted(folder, episode) for episode in (2, 0))
    rows = [recorded(folder), replayed(folder), teleoperated(folder), *broken_off, corrected()]
    for row in rows:
        print(" | ".join(row.values()))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
