"""Tables of docs/validation.md."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from functools import cache

import hil
from aero.channels import Channel
from figures.results import Rows
from hil.checks import DEFAULT, EXPERIMENTS
from hil.checks.excursion.check import simulated_fist
from hil.checks.staircase.tracking import staircase_metrics
from hil.verdict.findings import failed
from hil.verdict.judged_run import Validation
from hil.verdict.validation import validate

STAIRCASE, EXCURSION = EXPERIMENTS["staircase"], EXPERIMENTS["excursion"]
HANDS = (("paper", "pre"), ("reference", "pre"), ("reference", "0.2.0"))
"""Unit and firmware; the first is the paper's own hand."""
UNITS = [(unit, firmware) for unit in ("reference", "paper", "ideal") for firmware in ("pre", "0.2.0")]
JUDGED = [name for name in EXPERIMENTS if name in DEFAULT or name == "short_staircase"]
"""Experiments of `pytest tests/hil`."""
SUBJECTS = {**{channel.label: channel.title for channel in Channel}, "hand": "hand"}


@cache
def validation(unit: str, firmware: str, experiment: str) -> Validation:
    """Validate a homed emulated hand, seed 0, as `aero-hil validate --unit UNIT --firmware FIRMWARE` does."""
    with hil.emulate(unit=unit, firmware=firmware, seed=0, homed=True) as target:
        return validate(target, [experiment])


def staircase() -> Rows:
    """Tracking and rise of three hands and of the simulator, the paper's figures in brackets."""
    hands = [staircase_metrics(validation(*hand, "staircase").results["staircase"].recording) for hand in HANDS]
    names = [f"`{unit}`, {firmware}" for unit, firmware in HANDS]
    rises = ["rise, simulator", *(f"rise, {name}" for name in names)]
    rows = [["channel", *(f"RMS, {name}" for name in names), *rises]]
    for channel in Channel:
        papers, *others = (metrics[channel] for metrics in hands)
        paper = {
            name: STAIRCASE.metric(name, channel.label).paper[channel.label]
            for name in ("tracking_rms", "rise_model_ms", "rise_hand_ms")
        }
        digits = 1 if channel is Channel.THUMB_ABDUCTION else 2
        rows.append(
            [
                channel.title,
                f"{papers['tracking_rms']:.{digits}f} ({paper['tracking_rms']:.{digits}f})",
                *(f"{hand['tracking_rms']:.{digits}f}" for hand in others),
                f"{papers['rise_model_ms']:.0f} ({paper['rise_model_ms']:.0f})",
                f"{papers['rise_hand_ms']:.0f} ({paper['rise_hand_ms']:.0f})",
                *(f"{hand['rise_hand_ms']:.0f}" for hand in others),
            ]
        )
    return rows


def excursion() -> Rows:
    """Excursion of the paper's hand and of the simulator from open to a fist, the paper's figures in brackets."""
    found = validation("paper", "pre", "excursion").results["excursion"].measured
    # Metres and radians, shown in thousandths.
    simulated = simulated_fist("pre", "unshifted", "right")
    rows = [["channel", "hand", "simulator", "excursion &#124;Δ&#124;"]]
    for channel in Channel:
        here = found[channel.label]
        travel, difference = (EXCURSION.metric(name, channel.label) for name in ("fist_travel", "fist_difference"))
        digits = 0 if travel.unit == "mrad" else 2
        rows.append(
            [
                f"{channel.title}, {travel.unit}",
                f"{here['fist_travel']:.{digits}f} ({travel.paper[channel.label]:.{digits}f})",
                f"{1e3 * simulated[channel]:.{digits}f}",
                f"{here['fist_difference']:.{digits}f} ({difference.paper[channel.label]:.{digits}f})",
            ]
        )
    return rows


def units() -> Rows:
    """Checks out of limits by unit, firmware and channel; experiments that follow a failed one run all the same."""
    return _out_of_limits(UNITS)


def paper_unit() -> Rows:
    """Two rows of `units`."""
    return _out_of_limits(UNITS[2:4])


def _out_of_limits(units: Sequence[tuple[str, str]]) -> Rows:
    rows = [["unit", "firmware", "out of limits", *SUBJECTS.values()]]
    for unit, firmware in units:
        with hil.emulate(unit=unit, firmware=firmware, seed=0, homed=True) as target:
            found = [finding for name in JUDGED for finding in validate(target, [name]).findings]
        by_subject = Counter(finding.subject for finding in failed(found))
        assert by_subject.keys() <= SUBJECTS.keys()
        counts = (str(by_subject[subject] or "") for subject in SUBJECTS)
        rows.append([f"`{unit}`", firmware, f"{by_subject.total()} of {len(found)}", *counts])
    return rows


TABLES = (staircase, excursion, units)
SAMPLES = {units: paper_unit}
