"""The difference of two recordings, on recordings made by hand."""

import io
from dataclasses import replace

import numpy as np
import pytest
from rich.console import Console

from aero.channels import Channel
from aero.protocol import MAX_CODE
from hil.report.beside_run import beside_text
from hil.report.beside_run import difference as diff
from tests.support.synthetic import LABELS, held, replaced


def recording():
    return held("holding", np.full((100, 7), 0.5 * MAX_CODE), 0.1, dt=0.1)


def test_mean_rms_and_the_worst_difference_are_in_per_cent_of_the_window():
    """The second hand is 1 % further in three of four samples and 5 % less far in the fourth."""
    codes = recording()["codes"].values.copy()
    codes += 0.01 * MAX_CODE
    codes[::4] -= 0.06 * MAX_CODE
    found = diff(recording(), replaced(recording(), "codes", codes))
    for channel in Channel:
        row = found[channel]
        assert row.mean == pytest.approx((3 * 1 - 5) / 4)
        assert row.rms == pytest.approx(np.sqrt((3 * 1 + 25) / 4))
        assert row.worst == pytest.approx(-5.0)
        assert row.metrics["creep_percent"] == pytest.approx((0.0, 6.0))


def test_a_second_recording_with_other_times_is_read_at_the_first_ones():
    """It climbs by 1 % each 0.1 s and is sampled half a period later; beyond its ends it stands still."""
    climb = 0.001 * MAX_CODE * np.arange(100)[:, None] * np.ones(7)
    first = replaced(recording(), "codes", climb)
    series = first["codes"]
    later = replace(series, times=series.times + 0.05, values=climb + 0.0005 * MAX_CODE)
    found = diff(first, replace(first, series={**first.series, "codes": later}))
    assert [found[channel].worst for channel in Channel] == pytest.approx([0.05] * len(LABELS))
    assert [found[channel].mean for channel in Channel] == pytest.approx([0.0005] * len(LABELS))


def test_recordings_of_different_or_unknown_experiments_have_no_difference():
    other = recording()
    with pytest.raises(ValueError, match="not of audit and holding"):
        diff(recording(), replace(other, header=replace(other.header, experiment="audit")))
    unknown = replace(other, header=replace(other.header, experiment="policy"))
    with pytest.raises(ValueError, match="not of policy"):
        diff(unknown, unknown)


@pytest.mark.parametrize("percent", [1.0, -2.0])
def test_the_mean_that_is_printed_is_the_second_less_the_first(percent):
    further = replaced(recording(), "codes", recording()["codes"].values + 0.01 * percent * MAX_CODE)
    console = Console(file=io.StringIO(), width=120)
    for shown in beside_text(recording(), further):
        console.print(shown)
    row = next(line for line in console.file.getvalue().splitlines() if line.split()[:1] == ["ring"])
    assert [float(number) for number in row.split()[1:]] == pytest.approx([abs(percent), percent, percent])
