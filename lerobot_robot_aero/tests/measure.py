"""Measures the figures of docs/lerobot.md, in real time: `python lerobot_robot_aero/tests/measure.py FOLDER`.

Runs the page's commands in a folder and writes `docs/figures/stored/lerobot.json`.
"""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.metadata import version
from pathlib import Path

import numpy as np
from lerobot.datasets import LeRobotDataset
from lerobot_robot_aero.angles import AngleMap
from page_commands import OPENED, PAGE, begun, done, wait_for

from aero import ActuationMap, AeroHand
from aero.firmware import DEFAULT_FIRMWARE
from aero.protocol import MAX_CODE
from hil.recordings.mcap_file import read_recording
from hil.recordings.provenance import source_commit
from hil.recordings.wire_file import with_series

STORED = PAGE.parent / "figures" / "stored" / "lerobot.json"
FPS, EPISODES, EPISODE_S, TELEOPERATED_S = 30, 3, 10, 30
PATIENCE_S = 900.0


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
        readable = f"the data set cannot be read ({type(error).__name__})"
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


def main(folder: Path) -> None:
    """Measure everything and keep it."""
    command = "aero-hil run-policy --empty --seconds 10 --record motion.mcap"
    subprocess.run([sys.executable, "-m", "hil.cli", *command.split()[1:]], cwd=folder, check=True)
    rows = [recorded(folder), replayed(folder), teleoperated(folder), *(interrupted(folder, k) for k in (2, 0))]
    provenance = {
        "command": "python lerobot_robot_aero/tests/measure.py FOLDER",
        "seeds": "0",
        "commit": source_commit()[:7],
        "generator": f"LeRobot {version('lerobot')}, unit reference in real time, {os.cpu_count()} cores at a load of "
        f"{os.getloadavg()[2]:.0f}",
    }
    STORED.write_text(json.dumps({"provenance": provenance, "rows": rows}, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
