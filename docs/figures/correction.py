"""The typical correction that ships."""

from __future__ import annotations

import tomllib

from aero.policy.running import TYPICAL_CORRECTION_FILE
from aero.policy.shipped import DEFAULT, find_policy
from aero.whole_file import write_whole
from figures.inputs import ROOT
from figures.results import Rows, Shipped
from figures.sample_text import rows_of
from train.typical_correction import SEEDS, as_toml, corrections_of

FILE = f"aero/policy/shipped/{TYPICAL_CORRECTION_FILE}"


def remade() -> Rows:
    """The whole correction."""
    return rows_of(tomllib.loads(as_toml(corrections_of(SEEDS, find_policy(DEFAULT).settings))))


def shipped() -> Rows:
    """The file."""
    return rows_of(tomllib.loads((ROOT / FILE).read_text(encoding="utf-8")))


def make() -> None:
    """Write the file."""
    write_whole(ROOT / FILE, as_toml(corrections_of(SEEDS, find_policy(DEFAULT).settings)))


SHIPPED = {"typical": Shipped((FILE,), (), remade, make, shipped)}
