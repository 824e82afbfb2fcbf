"""The whole run: what the bytes between opening a hand and the end of its last experiment say about the link.

It is no experiment of its own: it is measured on the recording of the session that every validation makes.
"""

from __future__ import annotations

from dataclasses import dataclass

from aero.protocol import holds_boot_text
from hil.experiments.shared import subjects
from hil.experiments.shared.experiment import Measured, Metric
from hil.recordings.recording import Recording
from hil.targets.wire_log import WireRecord

FRAME = 16
"""Bytes of a host frame."""
MEASUREMENTS = range(0x22, 0x26)
"""Opcodes of requests that the board answers with one frame, at once."""


@dataclass
class _Exchange:
    """A request, and everything that came before the next one."""

    opcode: int
    received: bytes = b""


def measure(recording: Recording) -> Measured:
    """Return lost replies (%), bytes that belong to no frame (per thousand exchanges) and restarts of the board."""
    exchanges = _exchanges(recording.wire)
    asked = [exchange for exchange in exchanges if exchange.opcode in MEASUREMENTS]
    lost = sum(len(exchange.received) < FRAME for exchange in asked)
    texts = [exchange.received for exchange in exchanges if holds_boot_text(exchange.received)]
    stray = sum(len(exchange.received) % FRAME for exchange in exchanges if exchange.received not in texts)
    return {
        "hand": {
            "lost_replies": 100.0 * lost / max(1, len(asked)),
            "stray_bytes": 1000.0 * stray / max(1, len(exchanges)),
            "restarts": float(len(texts)),
        }
    }


def _exchanges(wire: tuple[WireRecord, ...]) -> list[_Exchange]:
    found: list[_Exchange] = []
    for record in wire:
        if record.direction == "to_hand":
            found.append(_Exchange(record.data[0]))
        elif found:
            found[-1].received += record.data
    return found


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
