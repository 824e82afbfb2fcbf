"""The whole run: what the bytes between opening a hand and the end of its last experiment say about the link.

It is no experiment of its own: it is measured on the recording of the session that every validation makes.
"""

from __future__ import annotations

from aero.protocol import FRAME_SIZE, holds_boot_text
from hil.checks.shared.exchanges import MEASUREMENTS, exchanges, lost_replies, surplus_frames
from hil.checks.shared.experiment import Measured
from hil.recordings.recording import Recording

LIMIT_REQUESTS = (0x31, 0x32)
"""Opcodes of requests for a speed or a torque limit, which every firmware but `pre` acknowledges."""


def measure(recording: Recording) -> Measured:
    """Return what the bytes of a session say about link and board.

    Lost replies (%), bytes that belong to no frame or to a reply too many (per thousand exchanges), restarts of the
    board, and limits that it was asked to keep and did not acknowledge (requests).
    """
    made = exchanges(recording.wire)
    asked = sum(exchange.opcode in MEASUREMENTS for exchange in made)
    restarted = holds_boot_text(b"".join(exchange.received for exchange in made))
    texts = [exchange.received for exchange in made if restarted and holds_boot_text(exchange.received)]
    quiet = [exchange for exchange in made if exchange.received not in texts]
    stray = sum(len(exchange.received) % FRAME_SIZE for exchange in quiet) + FRAME_SIZE * surplus_frames(quiet)
    return {
        "hand": {
            "lost_replies": 100.0 * lost_replies(made) / max(1, asked),
            "stray_bytes": 1000.0 * stray / max(1, len(made)),
            "restarts": float(len(texts)),
            "unanswered_limits": float(
                sum(exchange.opcode in LIMIT_REQUESTS and len(exchange.received) < FRAME_SIZE for exchange in made)
            ),
        }
    }
