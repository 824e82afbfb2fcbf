"""The tables beside the drawn hand show what is known."""

import numpy as np
import pytest

from aero.channels import Joint
from hil.view.frame import Heading, ViewFrame
from hil.view.panel import numbers

FIELDS = ("commanded", "measured", "currents", "temperatures", "tensions", "loose")


@pytest.mark.parametrize("missing", [*FIELDS, None])
def test_no_cell_of_a_frame_with_missing_readings_holds_nan(missing):
    known = {name: np.full(7, 0.01) for name in FIELDS if name != missing and missing is not None}
    page = numbers(Heading("hand", "right", live=True), ViewFrame(0.0, np.zeros(len(Joint)), **known), "")
    assert "nan" not in page
    assert "currents" not in known or "0.01 A" in page
