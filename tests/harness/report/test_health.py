"""Strips of a report: a mark in its band if and only if the reading is within limits."""

import math
from dataclasses import replace

from hypothesis import assume, given
from hypothesis import strategies as st

from hil.report.health import strip
from hil.verdict.limits import Limit

finite = st.floats(-1e3, 1e3)


@given(finite, finite, st.sampled_from(["both", "above", "below"]), finite)
def test_a_mark_is_in_the_band_if_and_only_if_the_reading_is_within_limits(low, high, side, value):
    assume(high - low > 1e-3)
    limit = Limit("staircase", "friction", ("ring",), at_least=low, at_most=high, healthy=(low, high))
    if side != "both":
        limit = replace(limit, at_least=-math.inf) if side == "above" else replace(limit, at_most=math.inf)
    shown = strip(value, limit, "A")
    assert 0.0 <= shown.band[0] < shown.band[1] <= 1.0
    assert 0.0 <= shown.at <= 1.0
    assert shown.outside is not (limit.at_least <= value <= limit.at_most)
    if shown.outside:
        assert not shown.band[0] + 1e-9 < shown.at < shown.band[1] - 1e-9
    elif side == "both":
        assert shown.band[0] - 1e-9 <= shown.at <= shown.band[1] + 1e-9


def test_a_reading_that_is_not_measurable_has_no_mark_and_no_blame():
    shown = strip(math.nan, Limit("staircase", "friction", ("ring",), at_most=1.0), "A")
    assert (shown.value, shown.at, shown.outside) == ("not measurable", None, False)
