"""An export opens with the public readers, in Foxglove's own schemas, and is still the recording."""

import json
import re
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest
from click.testing import CliRunner
from mcap.reader import make_reader

from aero.channels import Joint
from hil.checks import EXPERIMENTS
from hil.checks.shared.experiment import record
from hil.cli import main
from hil.emulated.any_hand import open_target
from hil.emulated.faults import parse_fault
from hil.recordings.mcap_file import read_recording, write_recording
from simulator.drawn_parts import PosedHand
from simulator.routed import build_routed

pytest.importorskip("foxglove_schemas_protobuf", reason="needs the extra `foxglove`")
from google.protobuf.timestamp_pb2 import Timestamp
from mcap_protobuf.decoder import DecoderFactory

from hil.report.foxglove import POSTURE_S, ROOT, frames, scene

SCHEMAS = {
    "/joints/measured": "foxglove.JointStates",
    "/joints/commanded": "foxglove.JointStates",
    "/hand/scene": "foxglove.SceneUpdate",
    "/hand/frames": "foxglove.FrameTransforms",
    "/findings": "foxglove.Log",
    "/events": "foxglove.Log",
}


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """A recording of a hand with a torn cable, and its export."""
    folder = tmp_path_factory.mktemp("export")
    with open_target(faults=[parse_fault("cable_snapped:ring")]) as target:
        record(EXPERIMENTS["audit"], target, folder / "audit.mcap")
    result = CliRunner().invoke(main, ["export", str(folder / "audit.mcap")])
    assert result.exit_code == 0, result.output
    assert json.loads(Path(result.output.split()[-1]).read_text())
    return folder / "audit.mcap", folder / "audit-foxglove.mcap"


def messages(path):
    with path.open("rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        wanted = [topic for topic, name in SCHEMAS.items() if topic != "/events"]
        return [(s, c.topic, m, d) for s, c, m, d in reader.iter_decoded_messages(topics=wanted, log_time_order=False)]


def test_an_export_is_still_the_recording(files):
    recording, exported = map(read_recording, files)
    assert exported == recording


def test_joint_states_follow_the_hand(files):
    found = [(m.log_time, d) for _, topic, m, d in messages(files[1]) if topic == "/joints/measured"]
    names = [joint.name for joint in found[0][1].joints]
    assert names == [joint.label for joint in Joint]
    assert np.diff([t for t, _ in found]).min() >= 1e9 * POSTURE_S - 1
    index = np.array([states.joints[Joint.INDEX_PIP].position for _, states in found])
    assert np.ptp(index) > 0.1
    assert np.abs(index).max() < np.pi / 2


def test_a_finding_is_a_line_where_the_seconds_that_show_it_begin(files):
    found = [(m.log_time, d.message) for _, topic, m, d in messages(files[1]) if topic == "/findings"]
    [followed] = [said for _, said in found if "Ring finger: motion after a nudge" in said]
    assert re.match(r"\d+\.\d to \d+\.\d s", followed)
    assert "checks passed" in found[-1][1]


@pytest.mark.parametrize("side", ["right", "left"])
def test_the_frames_are_those_of_the_simulated_hand(side):
    rng = np.random.default_rng(1)
    angles = rng.uniform(0.0, 0.9, len(Joint))
    model = build_routed(side).compile()
    data = mujoco.MjData(model)
    for joint in Joint:
        data.joint(joint.label).qpos = angles[joint]
    mujoco.mj_kinematics(model, data)
    hand = PosedHand(side)
    found = {frame.child_frame_id: frame for frame in frames(hand, angles, Timestamp()).transforms}
    assert {frame.parent_frame_id for frame in found.values()} == {ROOT}
    assert {entity.frame_id for entity in scene(hand, Timestamp()).entities} <= set(found)
    for name, frame in found.items():
        at, turn = frame.translation, frame.rotation
        assert np.allclose([at.x, at.y, at.z], data.body(name).xpos, atol=1e-6), name
        assert abs([turn.w, turn.x, turn.y, turn.z] @ data.body(name).xquat) == pytest.approx(1.0, abs=1e-6), name


def test_a_recording_that_was_broken_off_is_exported_without_findings(files, tmp_path):
    recording = read_recording(files[0])
    cut = replace(recording, header=replace(recording.header, finished=False))
    write_recording(cut, tmp_path / "cut.mcap")
    result = CliRunner().invoke(main, ["export", str(tmp_path / "cut.mcap"), "--out", str(tmp_path / "out.mcap")])
    assert result.exit_code == 0, result.output
    assert {topic for _, topic, _, _ in messages(tmp_path / "out.mcap")} >= {"/hand/scene", "/joints/measured"}
    assert read_recording(tmp_path / "out.mcap") == cut


def test_an_export_never_replaces_its_own_recording(files):
    before = files[0].read_bytes()
    result = CliRunner().invoke(main, ["export", str(files[0]), "--out", str(files[0])])
    assert result.exit_code == 2
    assert files[0].read_bytes() == before


def test_times_of_an_export_never_decrease(files):
    """A reader of a stream sees the samples in their order."""
    with files[1].open("rb") as stream:
        times = [message.log_time for _, _, message in make_reader(stream).iter_messages(log_time_order=False)]
    assert times == sorted(times)
