"""Tables of docs/validation.md."""

from __future__ import annotations

from collections.abc import Mapping

from aero.channels import Channel
from figures.cells import Cell
from figures.emulated import SEEDED, validation
from figures.sources import Row, Source
from figures.stored import Result, stored
from hil.checks import EXPERIMENTS
from hil.checks.staircase.tracking import ChannelMetrics, staircase_metrics
from hil.lab.campaign.summary import Share

STAIRCASE, EXCURSION = EXPERIMENTS["staircase"], EXPERIMENTS["excursion"]
COMPARED = ("tracking_rms", "rise_model_ms", "rise_hand_ms")
HANDS = (("paper", "pre"), ("reference", "pre"), ("reference", "0.2.0"))
"""Unit and firmware; the first is the paper's own hand."""


def staircase() -> list[Row]:
    """Tracking and rise of three hands and of the simulator, the paper's figures in brackets."""
    hands = [staircase_metrics(validation(*hand, "staircase").results["staircase"].recording) for hand in HANDS]
    names = [f"`{unit}`, {firmware}" for unit, firmware in HANDS]
    rises = ["rise, simulator", *(f"rise, {name}" for name in names)]
    header = ("channel", *(f"RMS, {name}" for name in names), *rises)
    return [header, *(_row(channel, [metrics[channel] for metrics in hands]) for channel in Channel)]


def excursion() -> list[Row]:
    """Way of the paper's hand and of the simulator from open to a fist, the paper's figures in brackets."""
    found = validation("paper", "pre", "excursion").results["excursion"].measured
    header = ("channel", "hand", "simulator", "excursion &#124;Δ&#124;")
    return [header, *(_excursion_row(channel, found[channel.label]) for channel in Channel)]


def _excursion_row(channel: Channel, found: Mapping[str, float]) -> Row:
    travel, difference = (EXCURSION.metric(name, channel.label) for name in ("fist_travel", "fist_difference"))
    digits = 0 if travel.unit == "mrad" else 2
    one, both = f"{{:.{digits}f}}", f"{{:.{digits}f}} ({{:.{digits}f}})"
    return (
        f"{channel.title}, {travel.unit}",
        Cell.of(both, found[travel.name], travel.paper[channel.label]),
        Cell.of(one, found["fist_travel_model"]),
        Cell.of(both, found[difference.name], difference.paper[channel.label]),
    )


def _row(channel: Channel, hands: list[ChannelMetrics]) -> Row:
    own, *others = hands
    paper = {name: STAIRCASE.metric(name, channel.label).paper[channel.label] for name in COMPARED}
    digits = 1 if own.unit == "mrad" else 2
    return (
        channel.title,
        Cell.of(f"{{:.{digits}f}} ({{:.{digits}f}})", own.tracking_rms, paper["tracking_rms"]),
        *(Cell.of(f"{{:.{digits}f}}", hand.tracking_rms) for hand in others),
        Cell.of("{:.0f} ({:.0f})", own.rise_model_ms, paper["rise_model_ms"]),
        Cell.of("{:.0f} ({:.0f})", own.rise_hand_ms, paper["rise_hand_ms"]),
        *(Cell.of("{:.0f}", hand.rise_hand_ms) for hand in others),
    )


def mutation(result: Result) -> list[Row]:
    """How many mutants of the judging code the unit tests notice."""
    header = ("sample", "noticed", "share, 95 %", "survived")
    rows = []
    for row in result.rows:
        share = Share(row["noticed"], row["size"])
        low, high = (100.0 * bound for bound in share.interval)
        rows.append(
            (
                f"{share.of} of {row['mutants']} mutants, seed {row['seed']}",
                str(share.count),
                Cell.of("{:.1f} % ({:.0f} to {:.0f})", 100.0 * share.value, low, high),
                str(share.of - share.count),
            )
        )
    return [header, *rows]


COMMAND = "`aero-hil validate --only staircase --unit UNIT --firmware FIRMWARE`"
FIST = "`aero-hil validate --only excursion --unit paper --firmware pre`"
TABLES = {
    "staircase": Source(staircase, COMMAND, SEEDED),
    "excursion": Source(excursion, FIST, SEEDED),
    "mutation": stored("mutation", mutation),
}
