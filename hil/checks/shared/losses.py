"""Losses on the link, counted once each; those during a delay of this computer are excused."""

from collections.abc import Collection, Container, Iterable, Sequence

from aero.protocol import FILLER, FRAME_SIZE
from hil.checks.shared.exchanges import MEASUREMENTS, UNANSWERED, Exchange
from hil.checks.shared.lateness import longest
from hil.targets.delays import Delay


def excused(delays: Collection[Delay], start: float, end: float) -> bool:
    """Return whether a delay of this computer, which may overflow its buffers, overlaps `start` to `end`, s."""
    return longest(delays, start, end) > 0.0


def lost_replies(
    made: Iterable[Exchange], opcodes: Container[int] = MEASUREMENTS, delays: Collection[Delay] = ()
) -> int:
    """Return the number of requests without a reply.

    A late reply, after another request, counts as received. Replies arrive in the order of their requests, so a reply
    to a later request shows that earlier ones were lost. A reply with the opcode of no waiting request is ignored.

    Args:
        made: exchanges in order.
        opcodes: counted requests.
        delays: delays of this computer, times as in `made`.
    """
    lost, waiting, since, end = 0, list[int](), 0.0, 0.0
    for exchange in made:
        if exchange.opcode not in UNANSWERED:
            since = since if waiting else exchange.t
            waiting.append(exchange.opcode)
        end = max([exchange.t, *exchange.times])
        for start in range(0, len(exchange.received) - FRAME_SIZE + 1, FRAME_SIZE):
            opcode, filler = exchange.received[start : start + 2]
            if opcode in waiting and filler == FILLER:
                before = waiting.index(opcode)
                lost += _counted(waiting[:before], opcodes, delays, since, end)
                del waiting[: before + 1]
    return lost + _counted(waiting, opcodes, delays, since, end)


def _counted(lost: Sequence[int], opcodes: Container[int], delays: Collection[Delay], since: float, end: float) -> int:
    found = sum(opcode in opcodes for opcode in lost)
    return 0 if found and excused(delays, since, end) else found
