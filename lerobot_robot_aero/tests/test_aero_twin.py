from contextlib import contextmanager

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from lerobot.teleoperators.utils import make_teleoperator_from_config
from lerobot.utils.errors import DeviceNotConnectedError
from lerobot_robot_aero.aero_twin import played
from lerobot_robot_aero.angles import POSITIONS, AngleMap, listed
from lerobot_robot_aero.opening import opened
from lerobot_robot_aero.playback import Playback, load_playback

import hil
from aero import ActuationMap, AeroHand, WallClock
from aero.firmware import DEFAULT_FIRMWARE
from aero.protocol import Opcode
from hil.emulated.emulated_spec import EmulatedSpec
from hil.emulated.pty_process import serve_in_child
from hil.recordings.errors import UnusableFileError
from hil.recordings.recorder import Recorder
from lerobot_robot_aero import AeroTwin, AeroTwinConfig, aero_twin

CODEC = ActuationMap.for_firmware(DEFAULT_FIRMWARE)


class Clock:
    """Tells the time that it is given."""

    t = 100.0

    def now(self):
        return self.t

    def sleep_until(self, t):
        self.t = t


times = st.lists(st.floats(0.01, 2.0), min_size=1, max_size=20).map(lambda gaps: np.cumsum([0.0, *gaps]))


def ramp(times):
    return Playback(times, np.arange(len(times))[:, np.newaxis] * np.ones(7), duration_s=times[-1] + 0.5)


@given(times, st.floats(0.0, 100.0))
def test_each_command_is_held_until_the_next(times, t):
    playback = ramp(times)
    held = playback.at(t, repeat=False)[0]
    assert held == max(k for k, begin in enumerate(times) if begin <= t)


@given(times, st.floats(0.0, 1.0, exclude_max=True), st.integers(0, 3))
def test_a_repeated_recording_is_the_same_every_time(times, share, turns):
    playback = ramp(times)
    once = share * playback.duration_s
    later = playback.at(once + turns * playback.duration_s, repeat=True)[0]
    # Rounding may put a time to the other side of a command, or of the end.
    assert later in {playback.at((once + d) % playback.duration_s, repeat=True)[0] for d in (-1e-9, 0.0, 1e-9)}


def test_the_last_command_is_held_to_the_end_of_the_recording_and_then_the_first_comes_again():
    playback = ramp(np.array([0.0, 1.0]))
    assert [playback.at(t, repeat=True)[0] for t in (0.9, 1.1, 1.4, 1.6, 2.6)] == [0.0, 1.0, 1.0, 0.0, 1.0]
    assert playback.at(9.0, repeat=False)[0] == 1.0


def test_a_recording_that_ends_with_its_only_command_is_that_command():
    playback = Playback(np.zeros(1), np.full((1, 7), 5.0), duration_s=0.0)
    assert playback.at(3.0, repeat=True).tolist() == playback.at(3.0, repeat=False).tolist() == [5.0] * 7


def test_a_recording_begins_when_it_is_first_asked():
    clock = Clock()
    source = played(ramp(np.array([0.0, 1.0, 2.0])), clock, repeat=False)
    clock.t = 150.0
    assert source()[0] == 0.0
    clock.t = 151.5
    assert source()[0] == 1.0


def test_the_commands_of_a_recording_come_back(recording, steps):
    playback = load_playback(recording)
    np.testing.assert_allclose(playback.times, [0.0, 0.5, 1.0], atol=0.01)
    assert playback.duration_s == pytest.approx(1.5, abs=0.01)
    assert [AngleMap(CODEC).codes(row).tolist() for row in playback.degrees] == [[*codes] for codes in steps]


def test_a_recording_without_a_command_is_refused(tmp_path):
    path = tmp_path / "still.mcap"
    with hil.emulate() as target:
        recorder = Recorder(target, "session", path)
        recorder.begin()
        target.hand.read_codes()
        recorder.finish()
    with pytest.raises(UnusableFileError, match="no position command"):
        load_playback(path)


def test_the_teleoperator_plays_a_recording(recording, steps, tmp_path):
    twin = make_teleoperator_from_config(AeroTwinConfig(recording=recording, calibration_dir=tmp_path))
    assert isinstance(twin, AeroTwin)
    with pytest.raises(DeviceNotConnectedError):
        twin.get_action()
    twin.connect()
    action = twin.get_action()
    assert [*action] == [*twin.action_features] == [*POSITIONS]
    assert AngleMap(CODEC).codes(listed(action)).tolist() == [*steps[0]]
    twin.disconnect()
    assert not twin.is_connected


@pytest.mark.parametrize("options", [{}, {"port": "emulated", "recording": "x.mcap"}])
def test_it_follows_either_a_hand_or_a_recording(options):
    with pytest.raises(ValueError, match="either a port or a recording"):
        AeroTwinConfig(**options)


@pytest.mark.slow
@pytest.mark.parametrize("limp", [False, True])
def test_it_reads_another_hand_and_sends_it_to_no_position(monkeypatch, steps, tmp_path, limp):
    """The hand is left in a posture, which it keeps when it is only read and leaves when it is let go."""
    posture = np.array(steps[2])
    with serve_in_child(EmulatedSpec()) as (path, _):
        with AeroHand.open_unguarded(path) as hand:
            clock = WallClock()
            hand.read_codes()
            for _ in range(20):
                hand.command_codes(posture)
                clock.sleep_until(clock.now() + 0.1)
            stood = AngleMap(CODEC).degrees(hand.read_codes())
        targets = []

        @contextmanager
        def noted(*args, **options):
            with opened(*args, **options) as target:
                targets.append(target)
                yield target

        monkeypatch.setattr(aero_twin, "opened", noted)
        twin = AeroTwin(AeroTwinConfig(port=path, limp=limp, calibration_dir=tmp_path))
        twin.connect()
        clock.sleep_until(clock.now() + 1.0)
        action = listed(twin.get_action())
        sent = {record.data[0] for record in targets[0].wire.since(0, 0.0) if record.direction == "to_hand"}
        twin.disconnect()
    assert Opcode.CTRL_POS not in sent
    assert stood[0] > 40.0
    if limp:
        assert action[0] < stood[0] - 5.0
    else:
        np.testing.assert_allclose(action, stood, atol=1.0)
