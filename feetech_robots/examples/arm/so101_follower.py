"""LeRobot's SO-101 follower, unmodified, on the emulated arm: calibrate, configure, follow a played leader.

    python examples/arm/so101_follower.py --aero-hil PATH_OF_THE_COMMAND [--seconds 60] [--silent 3]

Runs where LeRobot 0.6 is installed; `aero-hil emulate-bus` may be in another environment. A thread plays the person: it
moves the limp arm as the calibration asks, and presses ENTER. Prints one JSON object.
"""

import argparse
import json
import logging
import math
import os
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path
from typing import Any

from lerobot.robots.so_follower import SO101Follower, SO101FollowerConfig

HERE = Path(__file__).parent
RATE_HZ = 30.0
MIDDLE = {"shoulder_pan": 0, "shoulder_lift": 0, "elbow_flex": 0, "wrist_flex": 0, "wrist_roll": 0, "gripper": 45}
ENDS = {
    "shoulder_pan": (-105, 105),
    "shoulder_lift": (-95, 95),
    "elbow_flex": (-90, 90),
    "wrist_flex": (-90, 90),
    "gripper": (-8, 98),
}
SETTLE_S = 1.5
SILENCE_S = 0.3


class Person:
    """Moves the limp arm through the emulator's orders, and presses ENTER."""

    def __init__(self, emulator: subprocess.Popen[str]) -> None:
        self._emulator = emulator
        reading, self._keys = os.pipe()
        sys.stdin = os.fdopen(reading)

    def order(self, text: str) -> None:
        """Give the emulator a line, see `aero-hil emulate-bus --orders`."""
        assert self._emulator.stdin is not None
        self._emulator.stdin.write(text + "\n")
        self._emulator.stdin.flush()

    def press_enter(self) -> None:
        """Press ENTER at what this process asks."""
        os.write(self._keys, b"\n")

    def calibrate(self) -> None:
        """Do what LeRobot's calibration asks for: the middle, then every joint from end to end."""
        for joint, angle in MIDDLE.items():
            self.order(f"hold {joint} {angle}")
        time.sleep(SETTLE_S)
        self.press_enter()
        time.sleep(SETTLE_S)
        for end in (0, 1):
            for joint, angles in ENDS.items():
                self.order(f"hold {joint} {angles[end]}")
            time.sleep(SETTLE_S)
        for joint, angle in MIDDLE.items():
            self.order(f"hold {joint} {angle}")
        time.sleep(SETTLE_S)
        self.press_enter()


class Retries(logging.Handler):
    """Counts the reads that LeRobot had to ask for again."""

    count = 0

    def emit(self, record: logging.LogRecord) -> None:
        """Count one."""
        self.count += "Failed to sync read" in record.getMessage()


def leader(t: float) -> dict[str, float]:
    """Return the played action at `t` (s): slow sines around the middle, degrees; of the gripper 0 to 100."""
    action = {f"{joint}.pos": 25.0 * math.sin(2.0 * math.pi * t / (5.0 + place)) for place, joint in enumerate(MIDDLE)}
    action["gripper.pos"] = 50.0 + 30.0 * math.sin(2.0 * math.pi * t / 4.0)
    return action


def follow(robot: Any, person: Person, seconds: float, silent: int | None) -> dict[str, Any]:
    """Play the leader; return what became of reads and positions."""
    retries = Retries()
    logger = logging.getLogger("lerobot.motors.motors_bus")
    logger.addHandler(retries)
    logger.setLevel(logging.DEBUG)
    logger.propagate = False
    errors: dict[str, list[float]] = {joint: [] for joint in MIDDLE}
    lost: list[dict[str, Any]] = []
    durations, late, reads = [], 0, 0
    start, done = time.perf_counter(), 0
    while (t := done / RATE_HZ) < seconds:
        if silent is not None and done == round(seconds / 2 * RATE_HZ):
            person.order(f"silence {silent} {SILENCE_S}")
        begun = time.perf_counter()
        try:
            seen = robot.get_observation()
            reads += 1
        except ConnectionError as error:
            lost.append({"t_s": round(t, 2), "took_s": round(time.perf_counter() - begun, 3), "said": str(error)})
            seen = None
        durations.append(time.perf_counter() - begun)
        robot.send_action(leader(t))
        # What was commanded a tenth of a second ago: dead time and lag of the servos.
        if seen is not None and t > 1.0:
            for joint, wanted in leader(t - 0.1).items():
                errors[joint.removesuffix(".pos")].append(seen[joint] - wanted)
        done += 1
        left = start + done / RATE_HZ - time.perf_counter()
        late += left < 0.0
        time.sleep(max(left, 0.0))
    durations.sort()
    return {
        "reads": reads,
        "lost": lost,
        "retries": retries.count,
        "late_cycles": late,
        "read_ms_median": round(1e3 * durations[len(durations) // 2], 2),
        "read_ms_largest": round(1e3 * durations[-1], 1),
        "error_rms": {joint: round(math.sqrt(sum(e * e for e in own) / len(own)), 2) for joint, own in errors.items()},
        "error_largest": {joint: round(max(map(abs, own)), 2) for joint, own in errors.items()},
    }


def main() -> None:
    """Serve the arm, connect the follower to it, and say what happened."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--aero-hil", default="aero-hil", help="the command")
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--silent", type=int, help="ID of a servo that is silent for 0.3 s half way")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        link = Path(folder) / "arm"
        emulator = subprocess.Popen(
            [given.aero_hil, "emulate-bus", str(HERE / "arm.toml"), "--link", str(link), "--orders"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        try:
            assert emulator.stdout is not None
            assert emulator.stdout.readline() == f"ready {link}\n"
            person = Person(emulator)
            robot = SO101Follower(SO101FollowerConfig(port=str(link), id="emulated", calibration_dir=Path(folder)))
            moving = threading.Thread(target=person.calibrate)
            moving.start()
            sys.stdout, stdout = sys.stderr, sys.stdout
            robot.connect()
            sys.stdout = stdout
            moving.join()
            found = follow(robot, person, given.seconds, given.silent)
            found["calibration"] = {
                name: [own.homing_offset, own.range_min, own.range_max] for name, own in robot.calibration.items()
            }
            robot.disconnect()
            print(json.dumps(found, indent=1))
        finally:
            emulator.terminate()
            emulator.wait()


if __name__ == "__main__":
    main()
