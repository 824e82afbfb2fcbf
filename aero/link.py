"""Requests and replies over a transport: one at a time, bounded in time, robust against what a serial link does."""

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
from aero.protocol import (
    FRAME_SIZE,
    PADDING,
    READINGS,
    SINCE,
    Opcode,
    Reply,
    ReplyScanner,
    holds_boot_text,
    make_query,
)
from aero.transport import Transport

_LOG = logging.getLogger(__name__)
_QUIET_S = 0.02
_SETTLE_LIMIT_S = 1.0
_DRAIN_BYTES = 4096
_TEXT_KEPT = 4096
_SEARCHES = 2
"""Searches for the frame start: a reply from before the first one can mislead it."""
REPLY_TIMEOUT_S = 0.1
"""Time for one reply, s, before it is looked whether it is late or lost; a healthy board needs 1..10 ms."""
PATIENCE_S = 1.0
"""Time for a request that may be repeated, s: a busy machine may be late by 0.9 s, and a late reply is not lost. A
query of a link that has just answered gets `LATE_S`, unless the program needs to know earlier."""
AGAIN = 1.5
"""Time from one query of a kind to the next while a link is silent, time-outs: what answers late is not flooded."""
TOGETHER_S = 0.04
"""Time in which the replies to requests that were sent together come, s; three take 34 ms at 9600 baud."""

TELNET = (b"\xfb", b"\xfc", b"\xfd", b"\xfe")
"""What follows the byte 255 where a Telnet server negotiates: WILL, WONT, DO and DONT."""


class Answer(NamedTuple):
    """A reply, and the exchange that brought it."""

    reply: Reply
    asked: float
    """When its request was about to go out, clock s; the board made the reply later."""


class HostLink:
    """Exchanges frames with a board.

    The lock covers one exchange, from dropping stale input to the reply, or one command that has no reply. Threads may
    share a link; what two of them do in between exchanges is theirs to order. What may be sent when is a table,
    `aero.link_state`.
    """

    def __init__(self, transport: Transport, clock: Clock, longest_s: float = LATE_S) -> None:
        """Wrap an open transport; a reading lasts at most `longest_s` (s), 1 s after one that failed."""
        self.name = transport.name
        """What a person calls this link."""
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
        """When the first of the requests was sent that the board leaves unanswered, clock s; None while it answers."""
        self.read_from = clock.now()
        """When the last reading was asked for, clock s."""
        self.settings: dict[tuple[Opcode, Channel], int] = {}
        """Speed and torque limits that were set since the board started."""
        self.restarts = 0
        """How often boot text has been seen."""
        self.disturbances = 0
        """Exchanges that did not go as they should, and starts of the board."""

    @property
    def boot_text(self) -> str:
        """The last 4096 characters that the board printed at its starts; empty if it has not started meanwhile."""
        return self._text.decode("utf-8", errors="replace")

    @property
    def holds_back(self) -> bool:
        """Whether the replies to the present call may be held back: nothing has come, or the link is known for it."""
        return not self._stray and (not self._alive or self._overdue.one_at_a_time)

    def send(self, frame: bytes, content: Content = Content.FRAME) -> None:
        """Send a frame that the board does not answer.

        Args:
            frame: what to send.
            content: `HARMLESS_FRAME` for one that may be sent to a board that is out of step.

        Raises:
            ConnectionError: the link is gone.
            DesyncError: the board may be out of step; `resynchronise` has to succeed first.
        """
        with self._lock:
            self._write(frame, content)

    def ask(self, frame: bytes, once_s: float | None = None) -> Answer:
        """Send a request and return its reply, which is never that of an earlier request.

        A reply that is late is waited for, and one that is lost or disturbed is asked for again, for `PATIENCE_S`; for
        `LATE_S` where a reading meets silence after an exchange that went well. Whether it is late or lost shows in a
        query of another kind, sent after `REPLY_TIMEOUT_S`, because replies come in the order of their requests,
        `aero.overdue`. Where a reply may be an older one that others have overtaken, the
        request is made twice, with a query of another kind behind it: two equal replies are taken, and two other ones
        if that to the query comes right behind them.

        Args:
            frame: the request.
            once_s: time for the reply to a request that must not be carried out again, s; it is sent once.

        Raises:
            ConnectionError: the link is gone.
            LinkTimeoutError: nothing came.
            DesyncError: something came, but no reply; or the board may be out of step, as with `send`.
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
                # Two late ones that differ are not taken: of 50,000 calls with replies up to 3 s late, one was wrong.
                # A single reply in time is its own: no other request of its kind waits, see `_outlast`.
                if equal or (fence and in_time and self._comes_next(fence, Deadline(self._clock, together).remaining)):
                    return Answer(replies[-1], asked[0])
                self.disturbances += 1
                if once_s is not None or deadline.expired:
                    break
                _LOG.info("%s: no usable reply to %s, asked again", self.name, opcode.name)
                known = self._outlast(opcode, timeout_s, deadline)
            raise self._no_reply(opcode, within_s)

    def resynchronise(self) -> int:
        """Bring a board that holds 1..15 stray bytes back into step and return how many it held.

        The board takes sixteen bytes at a time and never looks for a frame's start. Fifteen zeros complete the frame
        that the stray bytes began; whatever opcode it got is carried out, with zeros for the rest of its payload.
        From then on only zeros and queries' opcodes are in the board, so nothing else can be: a query, then one more
        zero for every query that goes unanswered, finds the frame start after at most sixteen. A reply that is late
        belongs to an earlier one of them, so what it seems to say is confirmed by one query more. Until a search has
        succeeded, nothing else may be sent.

        Raises:
            ConnectionError: the link is gone.
            LinkTimeoutError: the board answered at no position; it is busy (homing), off, or no hand.
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
                        break  # else it is that to a request from before the search
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
            self._pad(-padding % FRAME_SIZE)  # whole frames in all: a board that was in step and mute stays in step
            raise LinkTimeoutError(
                f"{self.name}: the board answers at none of the {FRAME_SIZE} possible frame starts. It may be homing "
                "(wait up to a minute and try again), without power, or this is not the hand's port. Nothing else "
                "is sent until a search succeeds."
            )

    def _answers_now(self) -> bool:
        """Return whether the board answers a query that it is sent now, and not only earlier ones late."""
        old = {query: self._overdue.count(query, self._clock.now() - LATE_S) for query in READINGS}
        query = min((Opcode.GET_TEMP, Opcode.GET_VEL, Opcode.GET_CURR), key=lambda query: old[query])
        unsettled = 1 + old[query]
        if unsettled > FRAME_SIZE:
            return False  # too many may still be answered; each search adds as many
        for _ in range(unsettled):
            self._request(make_query(query), Content.SEARCH)
        while unsettled and (reply := self._take(PATIENCE_S)) is not None:
            unsettled -= reply.opcode == query
        return not unsettled

    def close(self) -> None:
        """Give the transport back; a second call does nothing."""
        self._transport.close()

    def _pad(self, count: int) -> int:
        """Write zeros and return how many."""
        self._write(PADDING * count, Content.SEARCH)
        return count

    def _require(self, content: Content) -> None:
        """Raise `DesyncError` unless it may be sent now."""
        if content not in MAY_LEAVE[self._state]:
            raise DesyncError(
                f"{self.name}: {REASON[self._state]}. Nothing was sent. Call resynchronise() until it succeeds, before "
                "anything else."
            )

    def _write(self, data: bytes, content: Content) -> None:
        self._require(content)
        # Until the write has returned, whatever interrupts it: Ctrl-C, a signal's exception, a link that is gone.
        before, self._state = self._state, AFTER[self._state, LinkEvent.WRITE_BEGINS]
        self._transport.write(data)
        self._state = before

    def _request(self, frame: bytes, content: Content = Content.FRAME) -> float:
        """Send a request and return when that was, clock s."""
        asked = self._clock.now()
        self._require(content)
        # First, because an interrupt may come after the write: a reply that nobody waits for would be taken for a later
        # one. A request that was not sent costs a little patience.
        self._overdue.sent(Opcode(frame[0]), asked)
        self._write(frame, content)
        if self.silent_from is None:
            self.silent_from = asked
        return asked

    def _outlast(self, opcode: Opcode, timeout_s: float, deadline: _Patience) -> bool:
        """Return whether no reply to an earlier `opcode` can come any more; with one request at a time, to any."""
        while opcode in self._overdue or self._overdue.wait_until(opcode, self._clock.now()) is not None:
            if deadline.expired:
                return False
            self._next_late(opcode, timeout_s, deadline)
        return True

    def _answer(self, opcode: Opcode, deadline: Deadline) -> Reply | None:
        """Return the reply to the last request, which older ones may precede; None when it does not come in time."""
        while True:
            reply = self._take(deadline.remaining)
            if reply is None or reply.opcode == opcode:
                return reply

    def _comes_next(self, opcode: Opcode, timeout_s: float) -> bool:
        """Return whether the next reply is to an `opcode`, with nothing before it that was not asked for."""
        self._stray = b""
        reply = self._take(timeout_s)
        return reply is not None and reply.opcode == opcode and not self._stray

    def _next_late(self, opcode: Opcode, timeout_s: float, deadline: _Patience) -> Reply | None:
        """Return the next of the late replies, or that to a query of another kind than `opcode`."""
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
        """Return the next reply that can come, None when it does not, or comes with surplus bytes."""
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
        # One byte too many, and no saying which: all after it stand in the wrong place.
        self._drop_stale_input(_QUIET_S)
        return None

    def _read(self, size: int, timeout_s: float) -> bytes:
        """Read what has been read ahead, then from the transport."""
        if not self._ahead:
            return self._transport.read(size, timeout_s)
        data = bytes(self._ahead[:size])
        del self._ahead[:size]
        return data

    def _drop_stale_input(self, quiet_s: float = 0.0) -> None:
        """Read away what lies there, and what comes before it has been quiet for a while."""
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
            self.settings = {}  # first: an interrupt in between must not leave limits that the board has lost
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
    """Deadline of one call: longer while the link says nothing, or is known to hold replies back."""

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
        """Whether no time is left."""
        return self.remaining == 0.0
