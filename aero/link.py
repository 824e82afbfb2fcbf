"""Requests and replies over a transport: one at a time, bounded in time, robust against what a serial link does."""

from __future__ import annotations

import logging
import threading

from aero.clock import Clock, Deadline
from aero.errors import DesyncError, LinkTimeoutError
from aero.protocol import (
    FRAME_SIZE,
    PADDING,
    SINCE_0_1_0,
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


class HostLink:
    """Exchanges frames with a board.

    The lock covers one exchange, from dropping stale input to the reply, or one command that has no reply. Threads may
    share a link; what two of them do in between exchanges is theirs to order.
    """

    def __init__(self, transport: Transport, clock: Clock) -> None:
        self._transport = transport
        self._clock = clock
        self._lock = threading.Lock()
        self._text = bytearray()
        self._restarts = 0
        self._cut_short = False
        self._reply_overdue = False

    @property
    def name(self) -> str:
        """What a person calls this link."""
        return self._transport.name

    @property
    def boot_text(self) -> str:
        """The last 4096 characters that the board printed at its starts; empty if it has not started meanwhile."""
        return self._text.decode("utf-8", errors="replace")

    @property
    def restarts(self) -> int:
        """How often boot text has been seen."""
        return self._restarts

    def send(self, frame: bytes) -> None:
        """Send a frame that the board does not answer.

        Raises:
            ConnectionError: the link is gone.
            DesyncError: an earlier frame went out incomplete.
        """
        with self._lock:
            self._write(frame)

    def ask(self, frame: bytes, timeout_s: float, attempts: int = 1) -> Reply:
        """Send a request and return its reply, asking up to `attempts` times `timeout_s` apart.

        Only a request that may be carried out twice may have more than one attempt.

        Raises:
            ConnectionError: the link is gone.
            LinkTimeoutError: nothing came.
            DesyncError: something came, but no reply; or an earlier frame went out incomplete.
        """
        with self._lock:
            stray = b""
            for _ in range(attempts):
                self._drop_stale_input()
                reply, left_over = self._exchange(frame, timeout_s)
                if reply is not None:
                    return reply
                stray += left_over
            raise self._no_reply(Opcode(frame[0]), timeout_s, attempts, stray)

    def resynchronise(self, reply_timeout_s: float) -> int:
        """Bring a board that holds 1..15 stray bytes back into step and return how many it held.

        The board takes sixteen bytes at a time and never looks for a frame's start. Fifteen zeros complete the frame
        that the stray bytes began; whatever opcode it got is carried out, with zeros for the rest of its payload.
        From then on only zeros and the query's opcode are in the board, so nothing else can be: a query, then
        one more zero for every query that goes unanswered, finds the frame start after at most sixteen.

        Raises:
            ConnectionError: the link is gone.
            LinkTimeoutError: the board answered at no position; it is busy (homing), off, or no hand.
        """
        with self._lock:
            self._cut_short = False
            padding = FRAME_SIZE - 1
            self._write(PADDING * padding)
            for _ in range(FRAME_SIZE):
                self._drop_stale_input()
                reply, _ = self._exchange(make_query(Opcode.GET_TEMP), reply_timeout_s)
                if reply is not None:
                    return -padding % FRAME_SIZE
                self._write(PADDING)
                padding += 1
            self._write(PADDING)  # a multiple of frames in all: a board that was in step and mute stays in step
            raise LinkTimeoutError(
                f"{self.name}: the board answers at none of the {FRAME_SIZE} possible frame starts. It may be homing "
                "(wait up to a minute and try again), without power, or this is not the hand's port."
            )

    def close(self) -> None:
        """Give the transport back; a second call does nothing."""
        self._transport.close()

    def _write(self, data: bytes) -> None:
        if self._cut_short:
            raise DesyncError(
                f"{self.name}: an earlier frame may have gone out incomplete, so the board can be waiting for the rest "
                "of it. Call resynchronise() before anything else."
            )
        try:
            self._transport.write(data)
        except ConnectionError:
            self._cut_short = True
            raise

    def _exchange(self, frame: bytes, timeout_s: float) -> tuple[Reply | None, bytes]:
        self._write(frame)
        scanner = ReplyScanner(Opcode(frame[0]))
        deadline = Deadline.after(self._clock, timeout_s)
        reply = None
        while reply is None and (received := self._transport.read(scanner.missing, deadline.remaining)):
            reply = scanner.feed(received)
        self._reply_overdue = reply is None
        self._note(scanner.stray)
        return reply, scanner.stray

    def _drop_stale_input(self) -> None:
        """Read away what lies there, and after a time-out also what still trickles in."""
        patience = _QUIET_S if self._reply_overdue else 0.0
        limit = Deadline.after(self._clock, _SETTLE_LIMIT_S)
        while stale := self._transport.read(_DRAIN_BYTES, patience):
            self._note(stale)
            if limit.expired:
                raise DesyncError(
                    f"{self.name}: bytes keep coming for {_SETTLE_LIMIT_S:g} s without a request, the latest "
                    f"{stale[:FRAME_SIZE].hex(' ')}; a hand never does this. Is this the hand's port?"
                )

    def _note(self, stray: bytes) -> None:
        if holds_boot_text(stray):
            self._restarts += 1
            self._text += stray
            del self._text[:-_TEXT_KEPT]
            _LOG.warning(
                "%s: the board has restarted (it printed its boot text). Speed and torque settings are back at their "
                "defaults, and firmware 0.2.0 has lost half of its thumb shift unless it homed; home() restores it.",
                self.name,
            )

    def _no_reply(self, opcode: Opcode, timeout_s: float, attempts: int, stray: bytes) -> Exception:
        asked = f"{self.name}: no reply to {opcode.name} within {timeout_s:g} s"
        if attempts > 1:
            asked += f", asked {attempts} times"
        if holds_boot_text(stray):
            return DesyncError(
                f"{asked}, only boot text (its first byte is 0x5B, '['): the board has just restarted and may be "
                "homing, for about 4 s with firmware 0.1.3 and later. Check supply and cable if nobody restarted it."
            )
        if stray:
            return DesyncError(
                f"{asked}, but {len(stray)} other bytes: {stray[: 2 * FRAME_SIZE].hex(' ')}. Is another program using "
                "the port, and is it the hand's?"
            )
        too_old = f"too old for {opcode.name} (firmware before 0.1.0), " if opcode in SINCE_0_1_0 else ""
        return LinkTimeoutError(
            f"{asked}. The board may be {too_old}homing (about 4 s after power-on, up to 45 s), without power, waiting "
            "for the rest of a frame that another program cut short (resynchronise() helps), or this is not the hand's "
            "port."
        )
