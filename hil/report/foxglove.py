"""Export of a recording with extra topics for Foxglove's panels, which `read_recording` ignores.

| topic | schema | content |
|---|---|---|
| `/joints/measured`, `/joints/commanded` | `foxglove.JointStates` | sixteen joint angles, rad |
| `/hand/scene` | `foxglove.SceneUpdate` | shapes of the hand, once |
| `/hand/frames` | `foxglove.FrameTransforms` | poses of the links |
| `/findings` | `foxglove.Log` | each finding, at the start of its evidence |

Joint angles derive from the encoders: one angle for all joints of a cable, which cannot distinguish them.
"""

from collections.abc import Callable, Iterator
from contextlib import closing
from functools import partial
from itertools import groupby
from pathlib import Path

import numpy as np
from foxglove_schemas_protobuf.Color_pb2 import Color
from foxglove_schemas_protobuf.CubePrimitive_pb2 import CubePrimitive
from foxglove_schemas_protobuf.CylinderPrimitive_pb2 import CylinderPrimitive
from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.JointState_pb2 import JointState
from foxglove_schemas_protobuf.JointStates_pb2 import JointStates
from foxglove_schemas_protobuf.Log_pb2 import Log
from foxglove_schemas_protobuf.Pose_pb2 import Pose
from foxglove_schemas_protobuf.Quaternion_pb2 import Quaternion
from foxglove_schemas_protobuf.SceneEntity_pb2 import SceneEntity
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from foxglove_schemas_protobuf.SpherePrimitive_pb2 import SpherePrimitive
from foxglove_schemas_protobuf.Vector3_pb2 import Vector3
from google.protobuf.message import Message
from google.protobuf.timestamp_pb2 import Timestamp
from mcap_protobuf.schema import build_file_descriptor_set
from numpy.typing import ArrayLike, NDArray

from aero.channels import Joint
from aero.whole_file import whole
from hil.checks import EXPERIMENTS
from hil.checks.shared.experiment import map_of
from hil.recordings.errors import writing
from hil.recordings.mcap_file import RecordingFile, epoch_ns
from hil.recordings.recording import Header, Recording
from hil.report.evidence import by_finding
from hil.verdict.findings import failed
from hil.verdict.validation import judge_recordings
from simulator.drawn_parts import DrawnPart, PosedHand, Vector

ROOT = "world"
"""Parent frame of all bodies."""
POSTURE_S = 0.05
"""Minimum time between two exported postures, s: enough for smooth playback."""
LAYOUT = Path(__file__).with_name("foxglove_layout.json")
"""Panel layout for Foxglove that ships with aero-hil."""

TimedEntry = tuple[float, Callable[[RecordingFile], None]]
"""Time of an entry, s since the start, and its writer."""


def export(recording: Recording, path: Path) -> None:
    """Write a recording for Foxglove atomically to `path`, in order of time.

    Raises:
        CannotBeWrittenError: the file cannot be written.
        Exception: the recording lacks required data; the file is then unchanged.
    """
    entries = sorted([*_recorded(recording), *_added(recording)], key=lambda entry: entry[0])
    with writing(path), whole(path) as draft, closing(RecordingFile(draft, recording.header)) as file:
        for name, series in recording.series.items():
            file.add_series(name, series.columns, series.units)
        for _, write in entries:
            write(file)
        file.finish(recording.header)


def _recorded(recording: Recording) -> Iterator[TimedEntry]:
    """Yield the entries of the recording itself."""
    for name, series in recording.series.items():
        add = partial(RecordingFile.add_sample, name=name, columns=series.columns, units=series.units)
        for t, row in zip(series.times.tolist(), series.values.tolist(), strict=True):
            yield t, partial(add, t=t, row=row)
    for record in recording.wire:
        yield record.t, partial(RecordingFile.add_wire, record=record)
    for event in recording.events:
        yield event.t, partial(RecordingFile.add_event, event=event)


def _added(recording: Recording) -> Iterator[TimedEntry]:
    """Yield the additional entries for Foxglove's panels."""
    header = recording.header
    at, posed = _timestamp(header, 0.0), PosedHand(header.side)
    yield _entry("/hand/scene", 0.0, scene(posed, at))
    yield _entry("/hand/frames", 0.0, frames(posed, np.zeros(len(Joint)), at))
    for topic, series in (("/joints/measured", "codes"), ("/joints/commanded", "command_codes")):
        for t, joints in _postures(recording, series):
            at = _timestamp(header, t)
            states = [JointState(name=joint.label, position=float(joints[joint])) for joint in Joint]
            yield _entry(topic, t, JointStates(timestamp=at, joints=states))
            if series == "codes":
                yield _entry("/hand/frames", t, frames(posed, joints, at))
    yield from _findings(recording)


def _postures(recording: Recording, name: str) -> Iterator[tuple[float, NDArray[np.float64]]]:
    """Yield times, s, and joint angles, (16,) rad, of a series of codes, at least `POSTURE_S` apart."""
    if name not in recording.series:
        return
    series, codec = recording[name], map_of(recording.header)
    shown = -np.inf
    for t, codes in zip(series.times.tolist(), series.values, strict=True):
        if t - shown >= POSTURE_S:
            shown = t
            yield t, codec.joints_from_compact(codec.compact_from_codes(codes.astype(np.int64)))


def _findings(recording: Recording) -> Iterator[TimedEntry]:
    """Yield the findings of a finished experiment; nothing for any other recording."""
    header = recording.header
    if header.experiment not in EXPERIMENTS or not header.finished:
        return
    judged = judge_recordings([recording])
    seen = by_finding(judged.judged)
    for finding in failed(judged.findings):
        where = seen.get(finding)
        said = f"{finding.sentence}."
        text = said if where is None else f"{where.words}: {said}"
        yield _line(header, 0.0 if where is None else where.start, Log.Level.ERROR, text)
    passed = len(judged.findings) - len(failed(judged.findings))
    text = f"{passed} of {len(judged.findings)} checks passed"
    yield _line(header, header.duration_s, Log.Level.INFO, text)


def _line(header: Header, t: float, level: Log.Level.ValueType, text: str) -> TimedEntry:
    said = Log(timestamp=_timestamp(header, t), level=level, message=text, name=header.experiment)
    return _entry("/findings", t, said)


def _entry(topic: str, t: float, message: Message) -> TimedEntry:
    kind, body = type(message), message.SerializeToString()
    schema = partial(_schema, kind)
    return t, partial(
        RecordingFile.add_for_viewers,
        topic=topic,
        schema_name=kind.DESCRIPTOR.full_name,
        schema=schema,
        t=t,
        body=body,
    )


def _schema(kind: type[Message]) -> bytes:
    files: bytes = build_file_descriptor_set(kind).SerializeToString()
    return files


def _timestamp(header: Header, t: float) -> Timestamp:
    seconds, nanos = divmod(epoch_ns(header) + round(t * 1e9), 10**9)
    return Timestamp(seconds=seconds, nanos=nanos)


def scene(posed: PosedHand, at: Timestamp) -> SceneUpdate:
    """Return the shapes of a hand without cables, each in the frame of its body."""
    by_body = groupby(posed.parts(), key=lambda part: part.body)
    return SceneUpdate(entities=[_entity(body, list(parts), at) for body, parts in by_body])


def frames(posed: PosedHand, joints: ArrayLike, at: Timestamp) -> FrameTransforms:
    """Pose the hand at joint angles, (16,) rad, and return the frames of all bodies."""
    posed.pose(joints)
    transforms = [
        FrameTransform(
            timestamp=at,
            parent_frame_id=ROOT,
            child_frame_id=body,
            translation=_vector(position),
            rotation=_quaternion(quaternion),
        )
        for body, position, quaternion in posed.frames()
    ]
    return FrameTransforms(transforms=transforms)


def _entity(body: str, parts: list[DrawnPart], at: Timestamp) -> SceneEntity:
    entity = SceneEntity(timestamp=at, frame_id=body, id=body, frame_locked=True)
    for part in parts:
        r, g, b, a = part.rgba
        pose = Pose(position=_vector(part.position), orientation=_quaternion(part.quaternion))
        size, color = _vector(part.size), Color(r=r, g=g, b=b, a=a)
        if part.shape == "box":
            entity.cubes.append(CubePrimitive(pose=pose, size=size, color=color))
        elif part.shape == "cylinder":
            drawn = CylinderPrimitive(pose=pose, size=size, bottom_scale=1.0, top_scale=1.0, color=color)
            entity.cylinders.append(drawn)
        else:
            entity.spheres.append(SpherePrimitive(pose=pose, size=size, color=color))
    return entity


def _vector(values: Vector) -> Vector3:
    x, y, z = values.tolist()
    return Vector3(x=x, y=y, z=z)


def _quaternion(values: Vector) -> Quaternion:
    w, x, y, z = values.tolist()
    return Quaternion(w=w, x=x, y=y, z=z)
