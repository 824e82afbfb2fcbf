"""Final tables of `aero-hil calibrate`: prediction errors of a unit on recordings."""

from itertools import product
from typing import NamedTuple

import numpy as np
from rich.box import SIMPLE_HEAD
from rich.table import Table

from aero.channels import Channel
from train.identification.replay_score import Errors, ReplayScore


class Quantity(NamedTuple):
    """Compared quantity with its print format."""

    unit: str
    field: str
    """Attribute of `Errors`."""
    digits: int
    scale: float = 1.0
    """Ratio of the printed unit to the field's unit."""


QUANTITIES = (Quantity("counts", "counts", 1), Quantity("mA", "currents_a", 0, 1e3), Quantity("°C", "warming_c", 1))
TITLE = "Rms of position, current and warming"


def score_tables(result: ReplayScore) -> tuple[Table, Table]:
    """Return the errors by channel and by recording, each at most 60 columns wide."""
    channels = Table("Channel", title=f"{TITLE}, all recordings (hand itself)", box=SIMPLE_HEAD, pad_edge=False)
    recordings = Table("Recording", title=f"{TITLE}, all channels", box=SIMPLE_HEAD)
    for table, quantity in product((channels, recordings), QUANTITIES):
        table.add_column(quantity.unit, justify="right", no_wrap=True)
    for row, name in enumerate((*(channel.label for channel in Channel), "all")):
        found = ((_cells(result.all_runs, one)[row], _cells(result.repeats, one)[row]) for one in QUANTITIES)
        channels.add_row(name, *(f"{error} ({itself})" for error, itself in found))
    for name, errors in result.runs:
        recordings.add_row(name, *(_cells(errors, quantity)[-1] for quantity in QUANTITIES))
    return channels, recordings


def _cells(errors: Errors, quantity: Quantity) -> list[str]:
    """Return the figure of each channel and of all together; a dash marks missing recordings."""
    values = quantity.scale * getattr(errors, quantity.field)
    finite = values[np.isfinite(values)]
    pooled = float(np.sqrt(np.mean(finite**2))) if finite.size else np.nan
    return [f"{value:.{quantity.digits}f}" if np.isfinite(value) else "-" for value in (*values, pooled)]
