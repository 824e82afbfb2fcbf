"""Tables of docs/validation.md."""

from __future__ import annotations

from collections.abc import Mapping

from aero.channels import Channel
from figures.cells import Cell
from figures.emulated import SEEDED, validation
from figures.sources import Row, Source
from hil.checks.staircase.tracking import ChannelMetrics, staircase_metrics
from hil.report.plots import title
from hil.verdict.paper_figures import PAPER

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
    paper = PAPER[channel]
    abduction = channel is Channel.THUMB_ABDUCTION
    one, both = ("{:.0f}", "{:.0f} ({:.0f})") if abduction else ("{:.2f}", "{:.2f} ({:.2f})")
    return (
        f"{title(channel)}, {'mrad' if abduction else 'mm'}",
        Cell.of(both, found["fist_travel"], paper.excursion_hand),
        Cell.of(one, found["fist_travel_model"]),
        Cell.of(both, found["fist_difference"], paper.excursion_difference),
    )


def _row(channel: Channel, hands: list[ChannelMetrics]) -> Row:
    paper, (own, *others) = PAPER[channel], hands
    digits = 1 if own.unit == "mrad" else 2
    return (
        title(channel),
        Cell.of(f"{{:.{digits}f}} ({{:.{digits}f}})", own.tracking_rms, paper.tracking_rms),
        *(Cell.of(f"{{:.{digits}f}}", hand.tracking_rms) for hand in others),
        Cell.of("{:.0f} ({:.0f})", own.rise_model_ms, paper.rise_model_ms),
        Cell.of("{:.0f} ({:.0f})", own.rise_hand_ms, paper.rise_hand_ms),
        *(Cell.of("{:.0f}", hand.rise_hand_ms) for hand in others),
    )


STAIRCASE = "`aero-hil validate --only staircase --unit UNIT --firmware FIRMWARE`"
EXCURSION = "`aero-hil validate --only excursion --unit paper --firmware pre`"
TABLES = {"staircase": Source(staircase, STAIRCASE, SEEDED), "excursion": Source(excursion, EXCURSION, SEEDED)}
