"""The last tables of `aero-hil calibrate`: how well a unit predicts recordings, and what the error goes with."""

from __future__ import annotations

from itertools import product
from typing import NamedTuple

import numpy as np
from rich.box import SIMPLE_HEAD
from rich.table import Table

from aero.channels import Channel
from train.identification.replay_score import REST, REVERSAL, SAG, Errors, ReplayScore


class Quantity(NamedTuple):
    """What is compared, and how it is printed."""

    unit: str
    field: str
    """Attribute of `Errors`."""
    digits: int
    scale: float = 1.0
    """Printed unit per unit of the field."""


QUANTITIES = (Quantity("counts", "counts", 1), Quantity("mA", "currents_a", 0, 1e3), Quantity("°C", "warming_c", 1))
"""Position, current and warming."""
TITLE = "Rms of position, current and warming"
WITH = {
    REVERSAL: "reversing at speed",
    SAG: "more than 4 A in total: the supply sags",
    REST: "at rest at the open hand: tension of the cables",
}
"""Text for each cause."""


def score_tables(result: ReplayScore) -> tuple[Table, Table, Table]:
    """Return the errors by channel, the errors by recording, and what the error goes with; each fits 60 columns."""
    channels = Table("Channel", title=f"{TITLE}, all recordings (hand itself)", box=SIMPLE_HEAD, pad_edge=False)
    recordings = Table("Recording", title=f"{TITLE}, all channels", box=SIMPLE_HEAD)
    for table, quantity in product((channels, recordings), QUANTITIES):
        table.add_column(quantity.unit, justify="right", no_wrap=True)
    for row, name in enumerate((*(channel.label for channel in Channel), "all")):
        found = ((_cells(result.all_runs, one)[row], _cells(result.repeats, one)[row]) for one in QUANTITIES)
        channels.add_row(name, *(f"{error} ({itself})" for error, itself in found))
    for name, errors in result.runs:
        recordings.add_row(name, *(_cells(errors, quantity)[-1] for quantity in QUANTITIES))
    causes = Table("Of the squared error", box=SIMPLE_HEAD)
    for head in ("position, %", "current, %"):
        causes.add_column(head, justify="right", no_wrap=True)
    for cause, shares in result.shares.items():
        causes.add_row(WITH[cause], *(f"{100 * share:.0f}" if np.isfinite(share) else "-" for share in shares))
    return channels, recordings, causes


def _cells(errors: Errors, quantity: Quantity) -> list[str]:
    """Return the figure of each channel and of all together; a dash for what was not recorded."""
    values = quantity.scale * getattr(errors, quantity.field)
    finite = values[np.isfinite(values)]
    pooled = float(np.sqrt(np.mean(finite**2))) if finite.size else np.nan
    return [f"{value:.{quantity.digits}f}" if np.isfinite(value) else "-" for value in (*values, pooled)]
