import dataclasses
from contextlib import contextmanager

import numpy as np
import pytest

import hil
from hil.emulated.faults import parse_fault
from hil.recordings.recorder import Recorder
from lerobot_robot_aero import AeroHandRobot, AeroHandRobotConfig, aero_hand_robot

STEPS = ((0, 0, 0, 0, 0, 0, 0), (20000, 10000, 0, 0, 0, 0, 0), (40000, 40000, 30000, 30000, 20000, 10000, 20000))


@pytest.fixture(scope="session")
def steps():
    """Return the commands of the recording, one every 0.5 s."""
    return STEPS


@pytest.fixture
def virtual(monkeypatch, tmp_path):
    """Make robots whose hands are in this process, on the virtual clock; they are opened at the end."""
    robots = []

    @contextmanager
    def opened(chosen, *, guarded):
        how = dataclasses.asdict(chosen)
        how = {"firmware": how["firmware"], "hand": how["side"], "unit": how["unit"], "seed": how["seed"]}
        faults = map(parse_fault, chosen.fault.split())
        with hil.emulate(**how, faults=faults, guarded=guarded) as target:
            yield target

    def make(**options):
        config = AeroHandRobotConfig(**{"port": "emulated", "calibration_dir": tmp_path} | options)
        robots.append(AeroHandRobot(config))
        return robots[-1]

    monkeypatch.setattr(aero_hand_robot, "opened", opened)
    yield make
    for robot in robots:
        if robot.is_connected:
            robot.disconnect()


@pytest.fixture(scope="session")
def recording(tmp_path_factory):
    """Return a recording of `STEPS` on an emulated hand."""
    path = tmp_path_factory.mktemp("recordings") / "steps.mcap"
    with hil.emulate() as target:
        recorder = Recorder(target, "session", path)
        recorder.begin()
        start = target.clock.now()
        for i, codes in enumerate(STEPS):
            target.clock.sleep_until(start + 0.25 + 0.5 * i)
            target.hand.command_codes(np.array(codes))
        target.clock.sleep_until(start + 0.25 + 0.5 * len(STEPS))
        recorder.finish()
    return path
