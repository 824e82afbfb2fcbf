"""Compute the typical correction of the cables from healthy hands: `python -m train.typical_correction`.

It writes the file that ships beside the policy's weights; the left hand is the right one's reflection and needs the
same.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from functools import partial
from importlib.resources import files
from pathlib import Path

import click
import numpy as np
from numpy.typing import NDArray

from aero.channels import Channel
from aero.policy.running import TYPICAL_CORRECTION_FILE
from aero.policy.settings import PolicySettings
from aero.policy.shipped import DEFAULT, find_policy
from aero.whole_file import write_whole
from hil.cli.options import SEED
from hil.cli.output import echo
from model.units.cable_correction import correction
from model.units.plausible import plausible_unit

FIRST_SEED, HANDS = 700_000, 200
"""Which hands; none of them is one that an evaluation names."""


def corrections_of(seeds: range, settings: PolicySettings) -> NDArray[np.float64]:
    """Return the exact correction of each hand `plausible:SEED`, (hands, 7), m, abduction rad."""
    with ThreadPoolExecutor() as pool:
        return np.array(list(pool.map(partial(correction, settings=settings), map(plausible_unit, seeds))))


def as_toml(rows: NDArray[np.float64], seeds: range) -> str:
    """Return the text of the file for corrections (hands, 7): mean and spread of each channel."""
    lines = [
        f"# Made by `python -m train.typical_correction --first-seed {seeds[0]} --hands {len(seeds)}`",
        f"# from plausible:{seeds[0]} to plausible:{seeds[-1]} (model/units/plausible.py), at the nominal grasp of",
        f"# `{DEFAULT}`. By how much longer each channel is commanded than the map says: m, abduction rad.",
    ]
    for table, values in (("mean", rows.mean(axis=0)), ("standard_deviation", rows.std(axis=0))):
        lines += ["", f"[{table}]", *(f"{channel.label} = {values[channel] + 0.0:.6f}" for channel in Channel)]
    return "\n".join(lines) + "\n"


@click.command()
@click.option("--first-seed", type=SEED, default=FIRST_SEED, show_default=True, help="First hand of the population.")
@click.option("--hands", type=click.IntRange(1), default=HANDS, show_default=True, help="How many.")
def main(*, first_seed: int, hands: int) -> None:
    """Write the typical correction beside the shipped policy."""
    seeds = range(first_seed, first_seed + hands)
    text = as_toml(corrections_of(seeds, find_policy(DEFAULT).settings), seeds)
    write_whole(Path(str(files("aero.policy.shipped") / TYPICAL_CORRECTION_FILE)), text)
    echo(text)


if __name__ == "__main__":
    main()
