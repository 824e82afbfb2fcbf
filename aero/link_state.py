"""Frame synchronisation of a board and its driver, and the frames allowed in each state.

Theory of operation
===================

The board reads bytes sixteen at a time and never searches for the start of a frame. After one lost or surplus byte it
may read any byte of the driver as an opcode. The driver therefore follows three rules.

Rule 1: send whole frames only. A link that drops whole writes then leaves the board in step. There are two exceptions:
a write that fails half-way, and the search for the frame start, which sends single bytes.

Rule 2: while the board may be out of step, send only bytes that are harmless at every alignment. The search sends
zeros (the board ignores opcode 0) and queries, which change no state. The ramp that opens a silent hand has opcodes
only in the first byte of each frame, where they are intended. `tests/aero/test_link_out_of_step.py` shows this for
every byte and every alignment.

Rule 3: pad a fragment of a real frame with zeros only. The board executes the padded frame, because it cannot drop
one, and zeros add the least motion.

The driver cannot observe the board's alignment. The state below records the driver's own writes instead.
"""

from enum import IntEnum, auto


class State(IntEnum):
    """Driver's knowledge of the board's alignment to frames."""

    IN_STEP = auto()
    """Whole frames have gone out since the last search that succeeded, or since the port was opened."""
    SEARCHING = auto()
    """A search has begun and not succeeded: the board's buffer may have zeros, or part of a query."""
    CUT = auto()
    """A write has not returned, and no search has succeeded since: the board's buffer may have part of any frame."""


class LinkEvent(IntEnum):
    """Event that changes the state."""

    SEARCH_BEGINS = auto()
    SEARCH_SUCCEEDS = auto()
    """The board answered twice in a row at the assumed frame start."""
    WRITE_BEGINS = auto()
    """A write is in progress; the previous state is restored when it returns."""


class Content(IntEnum):
    """Content of a write."""

    FRAME = auto()
    """One whole frame with any content."""
    HARMLESS_FRAME = auto()
    """One whole frame without opcodes after its first byte, `aero.protocol.make_harmless_positions`."""
    SEARCH = auto()
    """Zeros, or a query."""


AFTER: dict[tuple[State, LinkEvent], State] = {
    (State.IN_STEP, LinkEvent.SEARCH_BEGINS): State.SEARCHING,
    (State.IN_STEP, LinkEvent.SEARCH_SUCCEEDS): State.IN_STEP,
    (State.IN_STEP, LinkEvent.WRITE_BEGINS): State.CUT,
    (State.SEARCHING, LinkEvent.SEARCH_BEGINS): State.SEARCHING,
    (State.SEARCHING, LinkEvent.SEARCH_SUCCEEDS): State.IN_STEP,
    (State.SEARCHING, LinkEvent.WRITE_BEGINS): State.CUT,
    # The link may have dropped the zeros of the search, so only a successful search ends this state.
    (State.CUT, LinkEvent.SEARCH_BEGINS): State.CUT,
    (State.CUT, LinkEvent.SEARCH_SUCCEEDS): State.IN_STEP,
    (State.CUT, LinkEvent.WRITE_BEGINS): State.CUT,
}

MAY_LEAVE: dict[State, frozenset[Content]] = {
    State.IN_STEP: frozenset(Content),
    State.SEARCHING: frozenset({Content.HARMLESS_FRAME, Content.SEARCH}),
    State.CUT: frozenset({Content.SEARCH}),
}
"""Content allowed in a state."""

REASON: dict[State, str] = {
    State.SEARCHING: "the board's frame start was searched for in vain, so it may take any byte for an opcode",
    State.CUT: ("an earlier frame may have gone out incomplete, so that the board can be waiting for the rest of it"),
}
"""Reason for refusing a write, for messages."""
