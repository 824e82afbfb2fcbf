"""Session of the maker's SDK on a port: its whole public API once, or its sequence example; results as JSON.

Run as `python sdk_session.py PORT api|sequence`.
"""

import json
import sys
import time

from aero_open_sdk import aero_hand
from aero_open_sdk.aero_hand import AeroHand

OPEN = [0.0] * 7
PINKY, RING = [100.0, 35.0, 23.0, 0.0, 0.0, 0.0, 50.0], [100.0, 42.0, 23.0, 0.0, 0.0, 52.0, 0.0]
MIDDLE, INDEX = [83.0, 42.0, 23.0, 0.0, 50.0, 0.0, 0.0], [75.0, 25.0, 30.0, 50.0, 0.0, 0.0, 0.0]
PEACE, PEACE_THUMB = [90.0, 0.0, 0.0, 0.0, 0.0, 90.0, 90.0], [90.0, 45.0, 60.0, 0.0, 0.0, 90.0, 90.0]
ROCK = [0.0, 0.0, 0.0, 0.0, 90.0, 90.0, 0.0]
SEQUENCE = [
    (OPEN, 1.0), (PINKY, 0.5), (PINKY, 0.25), (RING, 0.5), (RING, 0.25), (MIDDLE, 0.5), (MIDDLE, 0.25), (INDEX, 0.5),
    (INDEX, 0.25), (OPEN, 0.5), (OPEN, 0.5), (PEACE, 0.5), (PEACE_THUMB, 0.5), (PEACE_THUMB, 1.0), (OPEN, 0.5),
    (OPEN, 0.5), (ROCK, 0.5), (ROCK, 1.0), (OPEN, 0.5),
]  # fmt: skip
"""Poses, degrees, and times, s, of the SDK's example `sequence`."""


def read(hand, what, tries=50):
    """Return seven values; the SDK gives a busy machine 10 ms only, and then returns None."""
    for _ in range(tries):
        if (found := getattr(hand, what)()) is not None:
            return len(found)
    return None


def readings(hand):
    """Read everything."""
    names = ("get_joint_positions_compact", "get_actuations", "get_actuator_currents", "get_actuator_temperatures",
             "get_actuator_speeds")  # fmt: skip
    return {name: read(hand, name) for name in names}


def api(hand):
    """Call every public method, and return its results."""
    said = readings(hand)
    for name in ("get_forward_kinematics", "get_joint_positions"):
        try:
            getattr(hand, name)()
        except NotImplementedError:
            said[name] = "not implemented"
    said["speed"] = [hand.set_speed(servo, 20000) for servo in range(7)]
    said["torque"] = [hand.set_torque(servo, 600) for servo in range(7)]
    said["id"] = hand.set_id(3, 500)
    said["trim"] = hand.trim_servo(4, 5)
    said["conversions"] = [hand.tendon_to_actuations(1.0), hand.actuations_to_tendon(1.0)]
    hand.run_trajectory([(OPEN, 0.2), (INDEX, 0.3), (OPEN, 0.3)])
    hand.set_joint_positions(hand.convert_seven_joints_to_sixteen(OPEN))
    hand.set_actuations([10.0] * 7)
    time.sleep(0.3)
    hand.ctrl_torque([100] * 7)
    time.sleep(0.3)
    said["later"] = readings(hand)
    hand.set_joint_positions(OPEN)
    time.sleep(0.8)
    said["homed"] = hand.send_homing()
    hand.set_joint_positions(OPEN)
    time.sleep(0.8)
    return said


def sequence(hand):
    """Run the SDK's example."""
    hand.run_trajectory(SEQUENCE)
    time.sleep(0.5)
    return readings(hand)


class _Captured:
    """Serial port that stores what is written."""

    def __init__(self, frames):
        self.frames = frames

    def write(self, data):
        self.frames.append(bytes(data))

    def flush(self):
        pass

    reset_input_buffer = reset_output_buffer = flush


def sdk_frames():
    """Return the position frames of `SEQUENCE`, in order, a hundredth of a second apart."""
    frames = []
    before, aero_hand.Serial = aero_hand.Serial, lambda *_settings, **_more: _Captured(frames)
    try:
        hand = AeroHand("captured")
    finally:
        aero_hand.Serial = before
    for pose in hand.create_trajectory(SEQUENCE):
        hand.set_joint_positions(pose)
    return frames


if __name__ == "__main__":
    opened = AeroHand(sys.argv[1])
    result = {"api": api, "sequence": sequence}[sys.argv[2]](opened)
    opened.close()
    print(json.dumps(result))
