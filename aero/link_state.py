"""Whether a board and its driver agree where frames start, and what may be sent while they may not.

Theory of operation
===================

The board takes bytes sixteen at a time, for ever, and never looks for the start of a frame. So the driver cannot send
"nothing harmful" by intention; every byte that it sends may be read as an opcode, if an earlier byte was lost or left
over. It keeps three rules.

Rule 1: whole frames only. A link that swallows whole writes then leaves the board in step. Two things break this: a
write that fails half-way, and the search for the frame start, which by its nature sends single bytes.

Rule 2: what is sent while the board may be out of step spells nothing, wherever the board begins to read. The search
sends zeros (opcode 0 is unknown; the board swallows its frame in silence) and queries, which change nothing. A ramp
that opens a hand whose board does not answer is made of bytes that are no opcodes, but for the first byte of each
frame; read from there, it is the frame that was meant. `tests/aero/test_link_out_of_step.py` shows it for every byte
and every alignment.

Rule 3: a fragment of a real frame is completed by zeros alone. The board carries it out, since nothing can take it
back, and a zero is the smallest thing that can be added to it.

The driver does not know where the board is. It knows what it has sent itself, which is the state below.
"""

from __future__ import annotations

from enum import IntEnum, auto


class State(IntEnum):
    """What the driver knows about the board's place in the stream of bytes."""

    IN_STEP = auto()
    """Whole frames have gone out since the last search that succeeded, or since the port was opened."""
    SEARCHING = auto()
    """A search has begun and has not succeeded: the board may hold any number of zeros, or a part of a query."""
    CUT = auto()
    """A write has begun that has not returned, and no search has succeeded since: the board may hold the beginning of
    any frame."""


class LinkEvent(IntEnum):
    """What changes that."""

    SEARCH_BEGINS = auto()
    SEARCH_SUCCEEDS = auto()
    """The board answered twice in a row where the driver believes frames to start."""
    WRITE_BEGINS = auto()
    """Until it has returned; then what held before holds again."""


class Content(IntEnum):
    """What a write is made of."""

    FRAME = auto()
    """One whole frame with any content."""
    HARMLESS_FRAME = auto()
    """One whole frame whose bytes after the first are no opcodes, `aero.protocol.make_harmless_positions`."""
    SEARCH = auto()
    """Zeros, or a query."""


AFTER: dict[tuple[State, LinkEvent], State] = {
    (State.IN_STEP, LinkEvent.SEARCH_BEGINS): State.SEARCHING,
    (State.IN_STEP, LinkEvent.SEARCH_SUCCEEDS): State.IN_STEP,
    (State.IN_STEP, LinkEvent.WRITE_BEGINS): State.CUT,
    (State.SEARCHING, LinkEvent.SEARCH_BEGINS): State.SEARCHING,
    (State.SEARCHING, LinkEvent.SEARCH_SUCCEEDS): State.IN_STEP,
    (State.SEARCHING, LinkEvent.WRITE_BEGINS): State.CUT,
    # The zeros of the search may have been swallowed on their way, so that a search alone does not end this.
    (State.CUT, LinkEvent.SEARCH_BEGINS): State.CUT,
    (State.CUT, LinkEvent.SEARCH_SUCCEEDS): State.IN_STEP,
    (State.CUT, LinkEvent.WRITE_BEGINS): State.CUT,
}
"""The state after an event."""

MAY_LEAVE: dict[State, frozenset[Content]] = {
    State.IN_STEP: frozenset(Content),
    State.SEARCHING: frozenset({Content.HARMLESS_FRAME, Content.SEARCH}),
    State.CUT: frozenset({Content.SEARCH}),
}
"""What may be sent in a state."""

REASON: dict[State, str] = {
    State.SEARCHING: "the board's frame start was searched for in vain, so it may take any byte for an opcode",
    State.CUT: ("an earlier frame may have gone out incomplete, so that the board can be waiting for the rest of it"),
}
"""Why something may not be sent."""
