"""Limit bands of the plots: each stands where the finding that it explains is read."""

import json

import pytest

import hil
from hil.checks import JUDGED, metric_of
from hil.checks.shared.subjects import CHANNELS
from hil.report.bands import banded
from hil.report.page import render_report
from hil.report.plots import ROWS, whole
from hil.verdict.validation import validate


@pytest.fixture(scope="module")
def broken():
    with hil.emulate(faults=("motor_dead:ring",)) as target:
        return validate(target, ["audit", "excursion"])


def test_a_failed_reading_is_outside_its_band_and_a_passed_one_inside(broken):
    compared = 0
    for name, result in broken.results.items():
        for row, channel, low, high, words in banded(whole(result.recording, ()), broken).bands:
            [metric] = [
                metric
                for metric in result.measured[CHANNELS[channel]]
                if (known := metric_of(name, metric, CHANNELS[channel])) is not None
                and (known.plotted, known.words) == (row, words)
            ]
            value = result.measured[CHANNELS[channel]][metric]
            [finding] = [f for f in result.findings if (f.check, f.subject) == (metric, CHANNELS[channel])]
            assert ((low is None or value >= low) and (high is None or value <= high)) == finding.passed
            compared += 1
    assert compared >= 2 * len(CHANNELS)


def test_the_page_draws_bands_as_json_and_names_their_reading(broken):
    page = render_report(broken)
    assert "Green: permitted end stop position, current at the end stop." in page
    plot = banded(whole(broken.results["excursion"].recording, ()), broken)
    assert json.loads(plot.json, parse_constant=pytest.fail)["bands"]


def test_each_declared_row_is_one_of_the_plots():
    declared = {metric.plotted for one in JUDGED.values() for metric in one.metrics} - {""}
    assert declared <= set(ROWS)
    assert declared == {"current", "position", "temperature"}
