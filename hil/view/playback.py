"""A recording as the frames that the page shows: what the driver was told and said, byte by byte."""

from __future__ import annotations

from aero.actuation import ActuationMap
from aero.actuation.coefficients import SHIPPED
from hil.recordings.recording import Recording
from hil.view.frame import Frame
from hil.view.sources import WireSource

FRAMES_PER_S = 30.0


def frames(recording: Recording) -> list[Frame]:
    """Return the frames of a recording, in the order of their time, at most `FRAMES_PER_S`.

    Raises:
        ValueError: no position was read while it was made, or its coefficients are not shipped.
    """
    header = recording.header
    if header.map not in SHIPPED:  # a file that a recording names is not opened
        raise ValueError(f"it was made with the coefficients {header.map!r}; shipped are {', '.join(SHIPPED)}")
    codec = ActuationMap.for_firmware(header.firmware, header.window, hand=header.hand, coefficients=header.map)
    source = WireSource(codec)
    found: list[Frame] = []
    due = 0.0
    for record in recording.wire:
        source.take(record)
        if record.direction == "from_hand" and record.t >= due and (frame := source.frame()) is not None:
            found.append(frame)
            due = record.t + 1.0 / FRAMES_PER_S
    if not found:
        raise ValueError(f"this recording of {header.experiment!r} holds no position of the hand, so nothing to show")
    return found
