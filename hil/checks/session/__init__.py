"""The whole run: what the bytes between opening a hand and the end of its last experiment say about the link.

It is no experiment of its own: it is measured on the recording of the session that every validation makes.
"""

from __future__ import annotations

from dataclasses import dataclass

from aero.protocol import FRAME_SIZE, holds_boot_text
from hil.checks.shared import subjects
from hil.checks.shared.exchanges import MEASUREMENTS, exchanges, lost_replies
from hil.checks.shared.experiment import Measured, Metric
from hil.recordings.recording import Recording


def measure(recording: Recording) -> Measured:
    """Return lost replies (%), bytes that belong to no frame (per thousand exchanges) and restarts of the board."""
    made = exchanges(recording.wire)
    asked = sum(exchange.opcode in MEASUREMENTS for exchange in made)
    texts = [exchange.received for exchange in made if holds_boot_text(exchange.received)]
    stray = sum(len(exchange.received) % FRAME_SIZE for exchange in made if exchange.received not in texts)
    return {
        "hand": {
            "lost_replies": 100.0 * lost_replies(made) / max(1, asked),
            "stray_bytes": 1000.0 * stray / max(1, len(made)),
            "restarts": float(len(texts)),
        }
    }


METRICS = (
    Metric(
        "lost_replies",
        "%",
        subjects.HAND,
        "In the course of the run replies got lost: a cable or plug that gives way when the hand moves, or a hub.",
        "Watch the link while the hand is moved; use a short data cable without a hub.",
    ),
    Metric(
        "stray_bytes",
        "per 1000 exchanges",
        subjects.HAND,
        "Bytes came that belong to no reply: another program on the port, or a link that doubles or drops bytes.",
        "Close everything else that opens the port; try another cable and another host port.",
    ),
    Metric(
        "restarts",
        "restarts",
        subjects.HAND,
        "The board restarted in the middle of the run: its supply sags, its plug is loose, or its firmware fails.",
        "Measure the supply while the hand closes; look at the plug; read the board's text in the events.",
    ),
)
"""What is measured, and what it means when it is off."""


@dataclass(frozen=True)
class WholeRun:
    """The run as something that is measured and judged."""

    name: str = "session"
    """Name of its recording, and in limits."""
    metrics: tuple[Metric, ...] = METRICS


WHOLE_RUN = WholeRun()
