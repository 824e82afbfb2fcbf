"""The bands of bench/baseline.json, and that every row of the table is one that is measured."""

import runpy
from pathlib import Path

from hypothesis import given
from hypothesis import strategies as st

ROOT = Path(__file__).parents[2]
TAKING = runpy.run_path(str(ROOT / "bench" / "take_baseline.py"))


@given(st.lists(st.floats(1.0, 10.0), min_size=3, max_size=3))
def test_a_band_is_15_percent_or_holds_every_run_that_it_was_made_from(ratios):
    band = TAKING["band_of"](ratios)
    assert band >= 0.15
    assert max(ratios) <= min(ratios) * (1.0 + band) * (1.0 + 1e-9)
    assert band == 0.15 or band - 0.05 <= max(ratios) / min(ratios) - 1.0 + 1e-9
