"""Presence: does a hand answer, completely and freshly, while nothing moves?

Leaves `codes`, `currents` and `temperatures`, and the bytes on the wire. The hand is not commanded.
"""

from __future__ import annotations

import numpy as np

from aero.channels import Channel
from hil.checks.shared import subjects
from hil.checks.shared.exchanges import exchanges, lost_replies
from hil.checks.shared.experiment import Experiment, Measured, Metric
from hil.recordings.recorder import Progress, Recorder
from hil.recordings.recording import Header, Recording
from hil.targets.boot_text import identify
from hil.targets.target import Target
from hil.targets.wire_log import WireRecord

READINGS = 30
PERIOD_S = 0.025
FRAME = 16
"""Bytes of a host frame; a request and its reply are one each."""


def run(target: Target, recorder: Recorder, progress: Progress) -> None:
    """Read everything a few dozen times."""
    recorder.begin({"readings": READINGS, "period_s": PERIOD_S})
    for i in range(READINGS):
        target.clock.sleep_until(recorder.start + i * PERIOD_S)
        recorder.add("codes", target.clock.now(), target.hand.read_codes())
        recorder.add("currents", target.clock.now(), target.hand.read_currents())
        recorder.add("temperatures", target.clock.now(), target.hand.read_temperatures())
        progress((i + 1) / READINGS, "reading")
    text = target.hand.boot_text
    if text:
        recorder.note(f"the board has restarted: {identify(text).describe()}", "warning")
    recorder.note_parameters(boot_text=text)


def measure(recording: Recording) -> Measured:
    """Return temperatures and idle currents by channel; lost replies, round trip and freshness of the hand."""
    currents, temperatures = recording["currents"].values, recording["temperatures"].values
    channels = {
        channel.label: {
            "temperature": float(temperatures[:, channel].max()),
            "idle_current": float(np.abs(np.median(currents[:, channel]))),
        }
        for channel in Channel
    }
    requests, trips = round_trips(recording.wire)
    return channels | {
        "hand": {
            "lost_replies": 100.0 * lost_replies(exchanges(recording.wire)) / requests,
            "round_trip": 1e3 * float(np.median(trips)),
            "distinct_readings": float(len(np.unique(currents, axis=0))),
            "boot_contradictions": float(_contradictions(recording.header)),
        }
    }


def _contradictions(header: Header) -> int:
    """Return how many things the boot text, if there was one, says against the header."""
    text = str(header.parameters["boot_text"])
    if not text:
        return 0
    board = identify(text)
    return (header.firmware not in board.versions) + (board.side not in (None, header.hand)) + len(board.silent)


def round_trips(wire: tuple[WireRecord, ...]) -> tuple[int, list[float]]:
    """Return how many requests went out, and the time (s) to the complete reply of each that was answered at once."""
    requests, trips = 0, []
    asked, received = 0.0, 0
    for record in wire:
        if record.direction == "to_hand":
            requests, asked, received = requests + 1, record.t, 0
        else:
            received += len(record.data)
            if received == FRAME:
                trips.append(record.t - asked)
    return requests, trips


METRICS = (
    Metric(
        "lost_replies",
        "%",
        subjects.HAND,
        "Replies get lost on the way: a lossy cable or hub, or another program on the port.",
        "Use a short data cable without a hub, and close everything else that opens the port.",
    ),
    Metric(
        "distinct_readings",
        "of 30 readings",
        subjects.HAND,
        (
            "Telemetry stands still: the board no longer reaches all seven servos. One that has the wrong ID,"
            " or a loose bus connector, is enough."
        ),
        (
            "Look at the boot text for a servo that does not answer. Check the bus cables, then scan the "
            "servos' IDs: they must be 0 to 6."
        ),
    ),
    Metric(
        "round_trip",
        "ms",
        subjects.HAND,
        "Readings take long.",
        "Connect without a hub or a network in between; look for another program that loads the machine.",
    ),
    Metric(
        "temperature",
        "degC",
        subjects.CHANNELS,
        "A hot servo, or (at zero) a sensor that is not read.",
        (
            "Let it cool with the power off and find what it pushes against at rest: a trim, a wrong zero, or"
            " a digit that is held."
        ),
    ),
    Metric(
        "idle_current",
        "A",
        subjects.CHANNELS,
        "The servo pushes against something although the hand is open and at rest.",
        (
            "Home the hand. With firmware 0.2.0, 0.25-0.29 A remain on CMC flexion whatever is commanded: its"
            " window begins 9.93 degrees beyond the open end."
        ),
    ),
    Metric(
        "boot_contradictions",
        "contradictions",
        subjects.HAND,
        (
            "The boot text is of another firmware or hand than was named, or a servo did not answer; the "
            "report's events say which."
        ),
        ("Name the firmware and side that are really there, or look for the servo: its bus connector, then its ID."),
    ),
)
"""What is measured, and what it means when it is off."""

EXPERIMENT = Experiment(
    "presence",
    "A hand answers, completely and freshly",
    run,
    measure,
    (0.0,) * 7,
    METRICS,
    rank=10,
    gate=True,
    gentle_after=frozenset({"idle_current"}),
)
