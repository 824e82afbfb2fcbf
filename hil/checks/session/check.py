"""Whole run: evidence about the link in the bytes from opening a hand to the end of its last experiment.

Not an experiment: measured on the session recording of every validation.
"""

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence

from aero.protocol import FRAME_SIZE, Opcode, holds_boot_text
from hil.checks.shared.exchanges import MEASUREMENTS, Exchange, exchanges, surplus_frames
from hil.checks.shared.experiment import Measured
from hil.checks.shared.losses import excused, lost_replies
from hil.recordings.recording import Recording

LIMIT_REQUESTS = (0x31, 0x32)
"""Opcodes of requests for a speed or torque limit, which every firmware except `pre` acknowledges."""
MOST, OFTEN = 240, 10
"""Thresholds of the distinct position bytes and of their occurrences; at both, an absent byte value is a fault.

In 12,000 positions of a hand that moved through its range, the rarest value occurs 25 times.
"""
STALL_S = 0.15
"""Threshold of the silence during requested measurements, s; above it the link counts as stalled.

After a lost reply, the driver sends another request within 0.1 s, which is answered at once.
"""


def measure(recording: Recording) -> Measured:
    """Return the metrics of link and board over a session's bytes.

    Lost replies (%), stray bytes and surplus replies (per thousand exchanges), absent byte values of positions, stalls,
    restarts of the board, and unacknowledged requests for limits; losses during a delay of this computer are excused.
    """
    made = exchanges(recording.wire)
    asked = sum(exchange.opcode in MEASUREMENTS for exchange in made)
    restarted = holds_boot_text(b"".join(exchange.received for exchange in made))
    texts = [exchange.received for exchange in made if restarted and holds_boot_text(exchange.received)]
    quiet = [exchange for exchange in made if exchange.received not in texts]
    odd = [exchange for exchange in quiet if len(exchange.received) % FRAME_SIZE]
    on_time = [one for one in odd if not excused(recording.delays, one.t, max(one.times))]
    stray = sum(len(exchange.received) % FRAME_SIZE for exchange in on_time) + FRAME_SIZE * surplus_frames(quiet)
    return {
        "hand": {
            "lost_replies": 100.0 * lost_replies(made, delays=recording.delays) / max(1, asked),
            "stray_bytes": 1000.0 * stray / max(1, len(made)),
            **_absent_values(made),
            "stalls": float(sum(not excused(recording.delays, *one) for one in stalls(made))),
            "restarts": float(len(texts)),
            "unanswered_limits": float(lost_replies(made, LIMIT_REQUESTS, recording.delays)),
        }
    }


def _absent_values(made: Iterable[Exchange]) -> dict[str, float]:
    """Return the number of byte values absent from all positions; nothing if the hand moved too little."""
    replies = [one.received[2:] for one in made if one.opcode == Opcode.GET_POS and len(one.received) == FRAME_SIZE]
    seen = Counter(b"".join(replies))
    return {"absent_values": float(256 - len(seen))} if len(seen) >= MOST and min(seen.values()) >= OFTEN else {}


def stalls(made: Sequence[Exchange]) -> Iterator[tuple[float, float]]:
    """Yield start and end (s) of each silence above `STALL_S` during requested measurements."""
    since: float | None = None
    for exchange in made:
        if exchange.opcode in MEASUREMENTS and since is None:
            since = exchange.t
        if exchange.times and since is not None:
            if exchange.times[0] - since > STALL_S:
                yield since, exchange.times[0]
            since = None
