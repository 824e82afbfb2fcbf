"""Presence: completeness and freshness of the replies of a hand at rest.

Records `codes`, `currents` and `temperatures`, and the bytes on the wire. The hand gets no commands.
"""

import numpy as np

from aero.channels import Channel
from aero.safety.cooling import let_cool
from hil.checks.shared.exchanges import exchanges
from hil.checks.shared.experiment import Measured, require
from hil.checks.shared.losses import lost_replies
from hil.recordings.recorder import Progress, Recorder
from hil.recordings.recording import Header, Recording
from hil.targets.boot_text import identify
from hil.targets.target import Target

READINGS = 30
PERIOD_S = 0.025
FURTHEST = (0.0,) * 7
"""Largest commanded fraction of each channel's window, command order."""


def run(target: Target, recorder: Recorder, progress: Progress) -> None:
    """Wait for servos that a homing has heated, then read all sensors `READINGS` times."""
    let_cool(target.hand.read_temperatures, target.clock, progress)
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
    """Return temperature and idle current by channel; lost replies, round trip and freshness of the hand."""
    currents, temperatures = recording["currents"].values, recording["temperatures"].values
    channels = {
        channel.label: {
            "temperature": float(temperatures[:, channel].max()),
            "idle_current": float(np.abs(np.median(currents[:, channel]))),
        }
        for channel in Channel
    }
    made = exchanges(recording.wire)
    trips = [one.completed - one.t for one in made if one.completed is not None]
    require(bool(trips), "replies")
    return channels | {
        "hand": {
            "lost_replies": 100.0 * lost_replies(made, delays=recording.delays) / len(made),
            "round_trip": 1e3 * float(np.median(trips)),
            "distinct_readings": float(len(np.unique(currents, axis=0))),
            "boot_contradictions": float(_contradictions(recording.header)),
        }
    }


def _contradictions(header: Header) -> int:
    """Return the number of contradictions between the boot text and the recording's header."""
    text = str(header.parameters.get("boot_text", ""))
    if not text:
        return 0
    board = identify(text)
    return (header.firmware not in board.versions) + (board.side not in (None, header.side)) + len(board.silent)
