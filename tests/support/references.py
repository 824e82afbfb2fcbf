"""A reference made by hand: some known faults, a plain model of the places, and trust that was learned elsewhere."""

from collections.abc import Sequence

from hil.verdict.dictionary import Entry
from hil.verdict.explanation import Place
from hil.verdict.likeness import Known
from hil.verdict.reference import Reference, Trust
from hil.verdict.whereabouts import Placing

PLACING = Placing(
    {},
    {
        Place.ONE_CHANNEL: {"share of the worst channel": 6.0, "": -3.0},
        Place.SEVERAL_CHANNELS: {"middle channel": 1.0},
        Place.SUPPLY: {"middle channel": 1.0},
        Place.BOARD: {"session/restarts": 1.0, "": -1.0},
        Place.LINK: {"exchanges": 1.0, "ended/LinkTimeoutError": 2.0, "": -1.0},
        Place.HOST_AND_DRIVER: {"": -3.0},
    },
)
TRUST = Trust(tuple(0.05 * i for i in range(8, 20)), 0.2, (8.0, -4.0))


def reference_of(entries: Sequence[Entry]) -> Reference:
    """Return a reference that knows these entries."""
    return Reference(Known(entries, {}), PLACING, TRUST)
