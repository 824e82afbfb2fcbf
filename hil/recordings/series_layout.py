"""Columns and units of the known series, and conversion of a file's series to them."""

import math

import numpy as np

from aero.channels import Channel
from aero.protocol import MAX_CODE
from hil.recordings.errors import UnusableFileError
from hil.recordings.recording import Series

CODES = ("codes", "command_codes")
LABELS = tuple(channel.label for channel in Channel)
LENGTH_UNITS = tuple("rad" if channel is Channel.THUMB_ABDUCTION else "m" for channel in Channel)
SERIES_UNITS: dict[str, tuple[str, ...]] = {
    **dict.fromkeys(("command", "model", "hand", "goal", "travel"), LENGTH_UNITS),
    **dict.fromkeys(CODES, ("u16",) * len(Channel)),
    "currents": ("A",) * len(Channel),
    "action": ("1",) * len(Channel),
    "temperatures": ("degC",) * len(Channel),
}
"""Known series of experiments, to the units of their seven columns."""
FACTORS = {("mA", "A"): 1e-3, ("mm", "m"): 1e-3, ("mrad", "rad"): 1e-3, ("deg", "rad"): math.pi / 180.0}
"""Pair of a file's unit and our unit, to the conversion factor."""


def conformed(name: str, series: Series) -> Series:
    """Return a series of a file with standard column order and units; an unknown series unchanged.

    Raises:
        UnusableFileError: other columns, or a unit without a conversion; the message names the unit.
    """
    if name not in SERIES_UNITS:
        return series
    if sorted(series.columns) != sorted(LABELS):
        raise UnusableFileError(f"series {name} has the columns {', '.join(series.columns)}, not {', '.join(LABELS)}")
    if name in CODES and len(series.values) and not 0 <= series.values.min() <= series.values.max() <= MAX_CODE:
        raise UnusableFileError(f"series {name} has values that are not codes: codes are 0 to {MAX_CODE}")
    # Another writer may order the columns differently, so match them by name.
    order = [series.columns.index(label) for label in LABELS]
    given = tuple(series.units[place] for place in order)
    if order == list(range(len(LABELS))) and given == SERIES_UNITS[name]:
        return series
    factors = []
    for label, unit, ours in zip(LABELS, given, SERIES_UNITS[name], strict=True):
        if unit != ours and (unit, ours) not in FACTORS:
            raise UnusableFileError(f"series {name} gives {label} in {unit!r}, which cannot be read as {ours!r}")
        factors.append(1.0 if unit == ours else FACTORS[unit, ours])
    return Series.of(LABELS, SERIES_UNITS[name], series.times, series.values[:, order] * np.array(factors))
