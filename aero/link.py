"""Exchange of requests and replies over a transport: serialised, with time-outs, robust against serial link faults."""

from __future__ import annotations

import logging
import threading
from itertools import cycle, islice
from typing import NamedTuple

from aero.channels import Channel
from aero.clock import Clock, Deadline
from aero.errors import AeroError, DesyncError, LinkTimeoutError
from aero.link_state import AFTER, MAY_LEAVE, REASON, Content, LinkEvent, State
from aero.overdue import LATE_S, Overdue
from aero.protocol import FRAME_SIZE, PADDING, READINGS, SINCE, Opcode, Reply, ReplyScanner, holds_boot_text, make_query
from aero.transport import Transport

_LOG = logging.getLogger(__name__)
_QUIET_S = 0.02
_SETTLE_LIMIT_S = 1.0
_DRAIN_BYTES = 4096
_TEXT_KEPT = 4096
_SEARCHES = 2
"""Number of searches for the frame start; a reply from before the first one can mislead it."""
REPLY_TIMEOUT_S = 0.1
"""Time-out of one reply, s, before a probe for a late or lost reply; a healthy board needs 1..10 ms."""
PATIENCE_S = 1.0
"""Time-out of a repeatable request, s; a busy computer may delay a reply by 0.9 s. A query after a successful exchange
gets `LATE_S`, unless `longest_s` is shorter."""
AGAIN = 1.5
"""Interval of repeated probes on a silent link, in time-outs, so that a slow link is not flooded."""
TOGETHER_S = 0.04
"""Time-out of replies to requests sent together, s; three take 34 ms at 9600 baud."""

TELNET = (b"\xfb", b"\xfc", b"\xfd", b"\xfe")
"""Telnet commands WILL, WONT, DO and DONT, which follow byte 255 in a negotiation."""


class Answer(NamedTuple):
    """Reply with the time of its request."""

    reply: Reply
    asked: float
    """Time just before the request was sent, clock s; the reply's values are newer."""


class HostLink:
    """Frame exchange with a board.

    The lock covers one exchange, from dropping stale input to the reply, or one command without a reply. Threads may
    share a link; they must order their own sequences of exchanges. The table in `aero.link_state` defines the content
    allowed in each state.
    """

    def __init__(self, transport: Transport, clock: Clock, longest_s: float = LATE_S) -> None:
        """Wrap an open transport; `longest_s` (s) is the time-out of a reading, 1 s after a failed one."""
        self.name = transport.name
        self._longest_s = longest_s
        self._alive = False
        self._transport = transport
        self._clock = clock
        self._lock = threading.RLock()  # reentrant: a signal handler may close the hand in the middle of an exchange
        self._text = bytearray()
        self._state = State.IN_STEP
        self._overdue = Overdue()
        self._stray = b""
        self._ahead = bytearray()
        self.silent_from: float | None = None
        """Send time of the first unanswered request, clock s; None while the board answers."""
        self.read_from = clock.now()
        """Request time of the last reading, clock s."""
        self.settings: dict[tuple[Opcode, Channel], int] = {}
        """Speed and torque limits set since the board started."""
        self.restarts = 0
        """Number of board starts detected by boot text."""
        self.disturbances = 0
        """Number of failed exchanges and of board starts."""

    @property
    def boot_text(self) -> str:
        """Last 4096 bytes of boot text; empty without a start of the board."""
        return self._text.decode("utf-8", errors="replace")

    @property
    def holds_back(self) -> bool:
        """True if the link may be delaying replies to the current call: no byte received, or a link under rule 5."""
        return not self._stray and (not self._alive or self._overdue.one_at_a_time)

    def send(self, frame: bytes, content: Content = Content.FRAME) -> None:
        """Send a frame that the board does not answer.

        Args:
            frame: what to send.
            content: `HARMLESS_FRAME` for a frame that is allowed while the board may be out of step.

        Raises:
            ConnectionError: the link is lost.
            DesyncError: the board may be out of step; `resynchronise` has to succeed first.
        """
        with self._lock:
            self._write(frame, content)

    def ask(self, frame: bytes, once_s: float | None = None) -> Answer:
        """Send a request and return its reply, never the reply to an earlier request.

        A late reply is waited for, and a lost or corrupted one is requested again, for up to `PATIENCE_S`; for up to
        `longest_s` if a reading gets no byte after a successful exchange. A probe with another opcode, sent after
        `REPLY_TIMEOUT_S`, distinguishes late from lost, because replies arrive in order (`aero.overdue`). If an older
        reply may be reordered, the request is sent twice with a probe behind it. Two equal replies are accepted;
        different ones only if the reply to the probe follows directly.

        Args:
            frame: the request.
            once_s: time-out, s, of a request that must not be executed twice, which is sent once; None allows retries.

        Raises:
            ConnectionError: the link is lost.
            LinkTimeoutError: no byte received.
            DesyncError: bytes without a valid reply; or the board may be out of step, as in `send`.
        """
        opcode = Opcode(frame[0])
        with self._lock:
            timeout_s, within_s = (REPLY_TIMEOUT_S, PATIENCE_S) if once_s is None else (once_s, once_s)
            may_be_held = once_s is None and self._alive and opcode in READINGS
            if not self._overdue:
                self._drop_stale_input()
            self._stray, self._alive = b"", False
            deadline = _Patience(self, within_s, self._longest_s if may_be_held else within_s)
            known = self._outlast(opcode, timeout_s, deadline)
            while known:
                # Two requests tell an old reply from the new one. Waiting until no old reply can arrive would take
                # `LATE_S` for each reading, and the protocol has no sequence number.
                doubtful = once_s is None and self._overdue.may_be_older(opcode, self._clock.now())
                asked = [self._request(frame) for _ in range(2 if doubtful else 1)]
                fence = self._overdue.probe(opcode) if doubtful else None
                if fence is not None:
                    self._request(make_query(fence))
                replies: list[Reply] = []
                together = asked[0]
                for _ in asked:
                    reply = self._answer(opcode, Deadline.after(self._clock, min(timeout_s, deadline.remaining)))
                    together = together if replies else self._clock.now() + TOGETHER_S
                    replies += [] if reply is None else [reply]
                in_time = len(replies) == len(asked)
                while once_s is None and opcode in self._overdue and not deadline.expired:
                    reply = self._next_late(opcode, timeout_s, deadline)
                    replies += [] if reply is None or reply.opcode != opcode else [reply]
                equal = len(replies) == len(asked) and len({*replies}) == 1
                # Two late replies that differ are rejected: accepting them gave 1 wrong of 50,000 calls with delays up
                # to 3 s. A single reply in time is genuine: `_outlast` leaves no other request of its opcode pending.
                if equal or (fence and in_time and self._comes_next(fence, Deadline(self._clock, together).remaining)):
                    return Answer(replies[-1], asked[0])
                self.disturbances += 1
                if once_s is not None or deadline.expired:
                    break
                _LOG.info("%s: no usable reply to %s, asked again", self.name, opcode.name)
                known = self._outlast(opcode, timeout_s, deadline)
            raise self._no_reply(opcode, within_s)

    def resynchronise(self) -> int:
        """Resynchronise a board with 1..15 stray bytes in its buffer and return their number.

        The board reads sixteen bytes at a time and never searches for a frame start. Fifteen zeros complete the frame
        begun by the stray bytes, which the board executes with a zero-padded payload. Afterwards its buffer has only
        zeros and opcodes of queries. Queries, with one more zero after each unanswered one, find the frame start after
        at most sixteen. A late reply may belong to an earlier query, so a further query confirms the position. Until a
        search has succeeded, all other content is refused.

        Raises:
            ConnectionError: the link is lost.
            LinkTimeoutError: no reply at any position: the board is homing, off, or not a hand.
        """
        with self._lock:
            self._drop_stale_input(_QUIET_S)
            self._state = AFTER[self._state, LinkEvent.SEARCH_BEGINS]
            padding = self._pad(FRAME_SIZE - 1)
            for _ in range(_SEARCHES):
                tried: list[tuple[Opcode, int]] = []
                reply = None
                for query in islice(cycle(READINGS), FRAME_SIZE):
                    tried.append((query, padding))
                    self._request(make_query(query), Content.SEARCH)
                    reply = self._take(REPLY_TIMEOUT_S)
                    if reply is not None and any(reply.opcode == query for query, _ in tried):
                        break  # any other reply is to a request from before the search
                    padding += self._pad(1)
                reply = reply or self._take(PATIENCE_S)
                if reply is None:
                    break
                for start in [start for query, start in reversed(tried) if query == reply.opcode]:
                    padding += self._pad((start - padding) % FRAME_SIZE)
                    began = self._clock.now()
                    if self._answers_now():
                        self._overdue.settle(began)
                        self._state = AFTER[self._state, LinkEvent.SEARCH_SUCCEEDS]
                        stray = -padding % FRAME_SIZE
                        _LOG.info("%s: back in step; the board held %d stray bytes", self.name, stray)
                        return stray
            self._pad(-padding % FRAME_SIZE)  # whole frames in total, so that a silent board in step stays in step
            raise LinkTimeoutError(
                f"{self.name}: the board answers at none of the {FRAME_SIZE} possible frame starts. It may be homing "
                "(wait up to a minute and try again), without power, or this is not the hand's port. Nothing else "
                "is sent until a search succeeds."
            )

    def _answers_now(self) -> bool:
        """Return whether the board answers a new query, not only earlier ones late."""
        old = {query: self._overdue.count(query, self._clock.now() - LATE_S) for query in READINGS}
        query = min((Opcode.GET_TEMP, Opcode.GET_VEL, Opcode.GET_CURR), key=lambda query: old[query])
        unsettled = 1 + old[query]
        if unsettled > FRAME_SIZE:
            return False  # too many pending queries; each search adds as many
        for _ in range(unsettled):
            self._request(make_query(query), Content.SEARCH)
        while unsettled and (reply := self._take(PATIENCE_S)) is not None:
            unsettled -= reply.opcode == query
        return not unsettled

    def close(self) -> None:
        """Release the transport; a second call does nothing."""
        self._transport.close()

    def _pad(self, count: int) -> int:
        """Write `count` zeros and return `count`."""
        self._write(PADDING * count, Content.SEARCH)
        return count

    def _require(self, content: Content) -> None:
        """Raise `DesyncError` unless `content` is allowed in the current state."""
        if content not in MAY_LEAVE[self._state]:
            raise DesyncError(
                f"{self.name}: {REASON[self._state]}. Nothing was sent. Call resynchronise() until it succeeds, before "
                "anything else."
            )

    def _write(self, data: bytes, content: Content) -> None:
        self._require(content)
        # The state stays CUT if anything interrupts the write: Ctrl-C, a signal's exception, a lost link.
        before, self._state = self._state, AFTER[self._state, LinkEvent.WRITE_BEGINS]
        self._transport.write(data)
        self._state = before

    def _request(self, frame: bytes, content: Content = Content.FRAME) -> float:
        """Send a request and return its send time, clock s."""
        asked = self._clock.now()
        self._require(content)
        # Recorded before the write, because an interrupt may follow the write: an unrecorded reply would be matched to
        # a later request. A recorded request that was not sent only costs some waiting.
        self._overdue.sent(Opcode(frame[0]), asked)
        self._write(frame, content)
        if self.silent_from is None:
            self.silent_from = asked
        return asked

    def _outlast(self, opcode: Opcode, timeout_s: float, deadline: _Patience) -> bool:
        """Wait until no earlier request of `opcode` (under rule 5: any request) is pending; False at the deadline."""
        while opcode in self._overdue or self._overdue.wait_until(opcode, self._clock.now()) is not None:
            if deadline.expired:
                return False
            self._next_late(opcode, timeout_s, deadline)
        return True

    def _answer(self, opcode: Opcode, deadline: Deadline) -> Reply | None:
        """Return the reply to the last request, skipping older replies; None at the deadline."""
        while True:
            reply = self._take(deadline.remaining)
            if reply is None or reply.opcode == opcode:
                return reply

    def _comes_next(self, opcode: Opcode, timeout_s: float) -> bool:
        """Return whether the next reply is to `opcode` and no stray bytes precede it."""
        self._stray = b""
        reply = self._take(timeout_s)
        return reply is not None and reply.opcode == opcode and not self._stray

    def _next_late(self, opcode: Opcode, timeout_s: float, deadline: _Patience) -> Reply | None:
        """Return the next late reply, or the reply to a probe other than `opcode`; None without one."""
        if self._stray:
            self._drop_stale_input(_QUIET_S)
        if (until := self._overdue.wait_until(opcode, self._clock.now())) is not None:
            return self._take(min(Deadline(self._clock, until).remaining, deadline.remaining))
        query, again = self._overdue.probe(opcode), Deadline(self._clock, self._overdue.latest + AGAIN * timeout_s)
        if query not in self._overdue or again.expired:
            self._request(make_query(query))
            again = Deadline.after(self._clock, timeout_s)
        return self._take(min(again.remaining, deadline.remaining))

    def _take(self, timeout_s: float) -> Reply | None:
        """Return the next pending reply; None if none arrives in time or surplus bytes follow."""
        scanner = ReplyScanner(*self._overdue.opcodes)
        deadline = Deadline.after(self._clock, timeout_s)
        reply = None
        while reply is None and (received := self._read(scanner.missing, deadline.remaining)):
            reply = scanner.feed(received)
        self._note(scanner.stray)
        if reply is None:
            return None
        self.silent_from, self._alive = None, True
        self._overdue.answered(Opcode(reply.opcode), self._clock.now())
        self._ahead += self._transport.read(_DRAIN_BYTES, 0.0)
        if not self._ahead or self._overdue.may_start(bytes(self._ahead)):
            return reply
        # A surplus byte at an unknown position, so the bytes after it are misaligned.
        self._drop_stale_input(_QUIET_S)
        return None

    def _read(self, size: int, timeout_s: float) -> bytes:
        """Read from the read-ahead buffer, or from the transport if it is empty."""
        if not self._ahead:
            return self._transport.read(size, timeout_s)
        data = bytes(self._ahead[:size])
        del self._ahead[:size]
        return data

    def _drop_stale_input(self, quiet_s: float = 0.0) -> None:
        """Drop received bytes until the link has been quiet for `quiet_s`."""
        limit = self._clock.now() + _SETTLE_LIMIT_S
        self._note(bytes(self._ahead))
        self._ahead.clear()
        while stale := self._transport.read(_DRAIN_BYTES, quiet_s):
            self._note(stale)
            if self._clock.now() >= limit:
                raise DesyncError(
                    f"{self.name}: bytes keep coming for {_SETTLE_LIMIT_S:g} s without a request, the latest "
                    f"{stale[:FRAME_SIZE].hex(' ')}; a hand never does this. Is this the hand's port?"
                )

    def _note(self, stray: bytes) -> None:
        if not stray:
            return
        self._stray += stray
        self._overdue.unasked(stray, self._clock.now())
        if holds_boot_text(stray):
            self.settings = {}  # first, so that an interrupt cannot leave limits that the board has lost
            self.restarts += 1
            self.disturbances += 1
            self._text += stray
            del self._text[:-_TEXT_KEPT]
            _LOG.warning(
                "%s: the board has restarted (it printed its boot text). Speed and torque settings are back at their "
                "defaults, and firmware 0.2.0 has lost half of its thumb shift unless it homed; home() restores it.",
                self.name,
            )

    def _no_reply(self, opcode: Opcode, timeout_s: float) -> AeroError:
        stray, asked = self._stray, f"{self.name}: no reply to {opcode.name} within {timeout_s:g} s"
        if holds_boot_text(stray):
            return DesyncError(
                f"{asked}, only boot text: the board has just restarted and may be "
                "homing, for about 4 s with firmware 0.1.3 and later. Check supply and cable if nobody restarted it."
            )
        if stray[:1] == b"\xff" and stray[1:2] in TELNET:
            return DesyncError(
                f"{asked}, but the first words of a Telnet server ({stray[:FRAME_SIZE].hex(' ')}): open a port that is "
                "served so as rfc2217://HOST:PORT, not as socket://."
            )
        if stray:
            return DesyncError(
                f"{asked}, but {len(stray)} other bytes: {stray[: 2 * FRAME_SIZE].hex(' ')}. Is another program using "
                "the port, and is it the hand's?"
            )
        too_old = f"too old for {opcode.name} (firmware before {SINCE[opcode]}), " if opcode in SINCE else ""
        return LinkTimeoutError(
            f"{asked}. The board may be {too_old}homing (about 4 s after power-on, up to 45 s), without power, waiting "
            "for the rest of a frame that another program cut short (resynchronise() helps), or this is not the hand's "
            "port."
        )


class _Patience:
    """Deadline of one call, extended while the link is silent or delays replies."""

    def __init__(self, link: HostLink, within_s: float, longest_s: float) -> None:
        self._link = link
        self._began = link._clock.now()
        self._within_s, self._longest_s = within_s, longest_s

    @property
    def remaining(self) -> float:
        """Seconds left, not below zero."""
        patience_s = self._longest_s if self._link.holds_back else self._within_s
        return max(0.0, self._began + patience_s - self._link._clock.now())

    @property
    def expired(self) -> bool:
        """True once no time is left."""
        return self.remaining == 0.0
