"""Sources of the page's frames: the bytes on the link to any hand.

A source is sampled in a separate thread while the hand is driven. Sampling is passive: it sends no bytes, and steps
neither physics nor clock.
"""

from functools import singledispatch
from typing import Protocol

import numpy as np

from aero.actuation import ActuationMap
from aero.actuation.coefficients import SHIPPED
from aero.channels import JOINT_BOX_RAD, Joint
from aero.driver import CURRENT_A_PER_UNIT
from aero.floats import Floats
from aero.protocol import FRAME_SIZE, Opcode, parse_reply, signed_values, unsigned_values
from hil.recordings.errors import UnusableFileError
from hil.recordings.recording import Recording
from hil.targets.target import Target
from hil.targets.wire_log import WireRecord
from hil.view.frame import ViewFrame, unknown

FRAMES_PER_S = 30.0
"""Frame rate, Hz: in real time for a live hand, in recorded time for a recording."""


class Source(Protocol):
    """Source of frames for the page."""

    def frame(self) -> ViewFrame | None:
        """Return the present frame, or None before the first data."""
        ...


class WireSource:
    """Hand of any kind, observed by the latest commands and replies on its link."""

    def __init__(self, codec: ActuationMap) -> None:
        self._codec = codec
        self._reply = b""
        self._last: dict[int, WireRecord] = {}
        """Latest frame by opcode."""

    def take(self, record: WireRecord) -> None:
        """Process bytes that cross the link, in order; called by the thread that drives the hand."""
        if record.direction == "to_hand":
            self._reply = b""
            taken = record.data[:1] in (bytes([Opcode.CTRL_POS]), bytes([Opcode.CTRL_TOR]))
        else:
            self._reply += record.data
            record = record._replace(data=self._reply)
            if taken := len(self._reply) >= FRAME_SIZE:
                self._reply = b""
        if taken and len(record.data) == FRAME_SIZE:
            self._last[record.data[0]] = record

    def frame(self) -> ViewFrame | None:
        """Return the present frame, with the posture by the actuation map from the encoder angles."""
        last = dict(self._last)
        if Opcode.GET_POS not in last:
            return None
        measured, commanded, currents, temperatures = (unknown() for _ in range(4))
        measured = self._angles(last[Opcode.GET_POS])
        asked, pulled = last.get(Opcode.CTRL_POS), last.get(Opcode.CTRL_TOR)
        if asked is not None and (pulled is None or pulled.t < asked.t):
            commanded = self._angles(asked)
        if (reply := last.get(Opcode.GET_CURR)) is not None:
            currents = np.abs(signed_values(parse_reply(reply.data)) * CURRENT_A_PER_UNIT)
        if (reply := last.get(Opcode.GET_TEMP)) is not None:
            temperatures = unsigned_values(parse_reply(reply.data)).astype(float)
        joints, wanted = (within_stops(posture(self._codec, angles)) for angles in (measured, commanded))
        time = max(record.t for record in last.values())
        return ViewFrame(time, joints, wanted, commanded, measured, currents=currents, temperatures=temperatures)

    def _angles(self, record: WireRecord) -> Floats:
        return np.asarray(self._codec.angles_from_codes(unsigned_values(parse_reply(record.data))), float)


@singledispatch
def source_of(target: Target) -> Source:
    """Return the frame source of a target: its link from now on; `hil.emulated.hand_source` adds the ground truth."""
    source = WireSource(target.map)
    target.wire.listeners.append(source.take)
    return source


def frames(recording: Recording) -> list[ViewFrame]:
    """Return the frames of a recording in order of time, at most `FRAMES_PER_S`.

    Raises:
        UnusableFileError: the recording has no position reading, or its map's coefficients are not shipped.
    """
    header = recording.header
    if header.map not in SHIPPED:  # a file path in a recording is untrusted and not opened
        raise UnusableFileError(f"it was made with the coefficients {header.map!r}; shipped are {', '.join(SHIPPED)}")
    codec = ActuationMap.for_firmware(header.firmware, header.window, side=header.side, coefficients=header.map)
    source = WireSource(codec)
    found: list[ViewFrame] = []
    due = 0.0
    for record in recording.wire:
        source.take(record)
        if record.direction == "from_hand" and record.t >= due and (frame := source.frame()) is not None:
            found.append(frame)
            due = record.t + 1.0 / FRAMES_PER_S
    if not found:
        said = f"this recording of {header.experiment!r} holds no position of the hand, so nothing to show"
        raise UnusableFileError(said)
    return found


def posture(codec: ActuationMap, angles: Floats) -> Floats:
    """Return the joint angles, (16,) rad, by the map from shaft angles, (7,) rad; all NaN if any angle is NaN."""
    if not np.isfinite(angles).all():
        return unknown(len(Joint))
    return np.asarray(codec.joints_from_compact(codec.compact_from_travel(codec.travel_from_angles(angles))))


def within_stops(joints: Floats) -> Floats:
    """Return joint angles, (16,) rad, clipped to their limits; a shaft beyond its limit only slackens the cable."""
    return np.clip(joints, *JOINT_BOX_RAD.T)
