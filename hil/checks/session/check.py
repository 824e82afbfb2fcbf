"""The whole run: what the bytes between opening a hand and the end of its last experiment say about the link.

It is no experiment of its own: it is measured on the recording of the session that every validation makes.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence

from aero.protocol import FRAME_SIZE, Opcode, holds_boot_text
from hil.checks.shared.exchanges import MEASUREMENTS, Exchange, exchanges, lost_replies, surplus_frames
from hil.checks.shared.experiment import Measured
from hil.checks.shared.lateness import longest
from hil.recordings.recording import Recording

LIMIT_REQUESTS = (0x31, 0x32)
"""Opcodes of requests for a speed or a torque limit, which every firmware but `pre` acknowledges."""
MOST, OFTEN = 240, 10
"""Values that some byte of a position had, and how often each of them, from which on none may be absent. In the 12,000
positions of a hand that moved through its range the rarest comes 25 times."""
STALL_S = 0.15
"""Time without any byte of a measurement that is asked for from which on the link stands still, s. Where one reply is
lost, the driver asks for another after 0.1 s, and that comes at once."""


def measure(recording: Recording) -> Measured:
    """Return what the bytes of a session say about link and board.

    Lost replies (%), bytes that belong to no frame or to a reply too many (per thousand exchanges), values that no
    byte of a position had, times at which nothing came although this computer was not held up, restarts of the board,
    and limits that it was asked to keep and did not acknowledge (requests).
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
            **_absent_values(made),
            "stalls": float(sum(longest(recording.delays, *one) == 0.0 for one in stalls(made))),
            "restarts": float(len(texts)),
            "unanswered_limits": float(
                sum(exchange.opcode in LIMIT_REQUESTS and len(exchange.received) < FRAME_SIZE for exchange in made)
            ),
        }
    }


def _absent_values(made: Iterable[Exchange]) -> dict[str, float]:
    """Return how many values no byte of a position had; nothing where a hand moved too little to have them all."""
    replies = [one.received[2:] for one in made if one.opcode == Opcode.GET_POS and len(one.received) == FRAME_SIZE]
    seen = Counter(b"".join(replies))
    return {"absent_values": float(256 - len(seen))} if len(seen) >= MOST and min(seen.values()) >= OFTEN else {}


def stalls(made: Sequence[Exchange]) -> Iterator[tuple[float, float]]:
    """Yield from when to when (s) measurements were asked for, and nothing came for longer than `STALL_S`."""
    since: float | None = None
    for exchange in made:
        if exchange.opcode in MEASUREMENTS and since is None:
            since = exchange.t
        if exchange.times and since is not None:
            if exchange.times[0] - since > STALL_S:
                yield since, exchange.times[0]
            since = None
