"""Compute the typical correction of the cables from healthy hands: `python -m train.typical_correction`.

Writes the file that ships beside the policy's weights. The left hand mirrors the right and needs the same correction.
"""

from concurrent.futures import ThreadPoolExecutor
from functools import partial
from importlib.resources import files
from pathlib import Path

import numpy as np
import tomli_w
from numpy.typing import NDArray

from aero.channels import Channel
from aero.policy.running import TYPICAL_CORRECTION_FILE
from aero.policy.settings import PolicySettings
from aero.policy.shipped import DEFAULT, find_policy
from aero.whole_file import write_whole
from model.units.cable_correction import correction
from model.units.plausible import plausible_unit

SEEDS = range(700_000, 700_200)
"""Seeds of the hands; no evaluation uses them."""


def corrections_of(seeds: range, settings: PolicySettings) -> NDArray[np.float64]:
    """Return the exact correction of each hand `plausible:SEED`, (hands, 7), m, abduction rad."""
    with ThreadPoolExecutor() as pool:
        return np.array(list(pool.map(partial(correction, settings=settings), map(plausible_unit, seeds))))


def as_toml(rows: NDArray[np.float64]) -> str:
    """Return the file's text for corrections (hands, 7): mean and standard deviation of each channel."""
    lines = [
        "# Made by `python -m train.typical_correction`",
        f"# from plausible:{SEEDS[0]} to plausible:{SEEDS[-1]} (model/units/plausible.py), at the nominal grasp of",
        f"# `{DEFAULT}`. By how much longer each channel is commanded than the map says: m, abduction rad.",
    ]
    tables = {"mean": rows.mean(axis=0), "standard_deviation": rows.std(axis=0)}
    rounded = {name: {one.label: round(values[one] + 0.0, 6) for one in Channel} for name, values in tables.items()}
    return "\n".join(lines) + "\n\n" + tomli_w.dumps(rounded)


if __name__ == "__main__":
    text = as_toml(corrections_of(SEEDS, find_policy(DEFAULT).settings))
    write_whole(Path(str(files("aero.policy.shipped") / TYPICAL_CORRECTION_FILE)), text)
