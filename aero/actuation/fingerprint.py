"""What a hand's own readings tell about its command window.

The board reports `floor(n * 65535 / span)` for a shaft n servo counts into a window of `span` counts, so a handful of
different readings gives the span away. That finds the mixed state of firmware 0.2.0 and a channel that has been
trimmed. It cannot tell the homed from the unshifted state: both ends have moved together there.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aero.actuation.arrays import whole_numbers
from aero.actuation.window import COUNTS_PER_TURN
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
