"""The measurement of cables that ships."""

from __future__ import annotations

from aero.policy.cables import LINES_FILE
from aero.policy.shipped import DEFAULT, find_policy
from aero.whole_file import write_whole
from figures.inputs import ROOT
from figures.results import Rows, Shipped
from train.cable_measurement import SEEDS, example, made

FILE = f"aero/policy/shipped/{LINES_FILE}"


def remade() -> Rows:
    """One of the hands that the lines are fitted to: observed travels and exact corrections, mm."""
    seen = example(SEEDS[0], find_policy(DEFAULT).settings)
    rows = [
        (channel.label, *(f"{1e3 * travel:.2f}" for travel in (*travels, seen.correction[channel])))
        for channel, travels in seen.seen.items()
    ]
    return [("channel", "slack", "stop", "correction"), *rows]


def make() -> None:
    """Write the file."""
    write_whole(ROOT / FILE, made())


SHIPPED = {"measurement": Shipped((FILE,), (), remade, make)}
