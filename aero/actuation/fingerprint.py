"""What a hand's own readings tell about its command window.

The board reports `floor(n * 65535 / span)` for a shaft n servo counts into a window of `span` counts, so a handful of
different readings gives the span away. That finds the mixed state of firmware 0.2.0 and a channel that has been
trimmed. It cannot tell the homed from the unshifted state: both ends have moved together there.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aero.actuation.arrays import whole_numbers
from aero.actuation.window import COUNTS_PER_TURN, CommandWindow
from aero.channels import Channel
from aero.errors import WindowMismatchError
from aero.protocol import MAX_CODE


def fits_span(readings: ArrayLike, span_counts: ArrayLike) -> NDArray[np.bool_]:
    """Say which readings (0..65535) a window of `span_counts` can produce; both broadcast.

    A reading fits a wrong span by chance with a probability of `span_counts` / 65535, 2 to 5 %.

    Raises:
        ValueError: not integers, or out of range.
    """
    codes = whole_numbers(readings, None, 0, MAX_CODE, "readings")
    span = whole_numbers(span_counts, None, 1, COUNTS_PER_TURN - 1, "span_counts")
    counts = -(-codes * span // MAX_CODE)
    fits: NDArray[np.bool_] = counts * MAX_CODE // span == codes
    return fits


def possible_spans(readings: ArrayLike) -> NDArray[np.int64]:
    """Return the spans (servo counts, 1..4095) that can have produced all readings (n,) of one channel.

    A span's multiples can always produce what it can, so of several that share a divisor the least is meant.
    """
    spans = np.arange(1, COUNTS_PER_TURN)
    return spans[fits_span(np.asarray(readings)[:, np.newaxis], spans).all(axis=0)]


def check_readings(window: CommandWindow, readings: ArrayLike) -> None:
    """Check that readings can come from a hand with this window.

    Args:
        window: what the hand is taken to have.
        readings: (n, 7) integers in 0..65535, command order; two dozen different ones a channel name the span.

    Raises:
        WindowMismatchError: some cannot; the message names the channels, their spans and what to do.
    """
    codes = whole_numbers(readings, len(Channel), 0, MAX_CODE, "readings")
    if codes.ndim != 2:
        raise ValueError(f"readings: expected shape (n, {len(Channel)}), got {codes.shape}")
    expected = window.spans_counts()
    wrong = [c for c in Channel if not fits_span(codes[:, c], expected[c]).all()]
    if wrong:
        found = "; ".join(f"{c.label} {_spans(codes[:, c])}, expected {expected[c]}" for c in wrong)
        raise WindowMismatchError(
            f"the hand's readings do not come from window {window.name!r}: {found}. With firmware 0.2.0, spans of 1025 "
            "(abduction) and 1296 (CMC flexion) mean a restart without homing; others mean a trim. Home the hand, or "
            "make a map with the CommandWindow that it has."
        )


def _spans(readings: NDArray[np.int64]) -> str:
    spans = possible_spans(readings)
    if spans.size and not (spans % spans[0]).any():
        return f"{spans[0]} counts"
    return f"one of {spans.size} spans" if spans.size else "no single span"
