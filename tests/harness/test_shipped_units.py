"""The shipped units, homed as physical hands are, pass a full staircase against their limits: the regression."""

import pytest

from hil.targets.opening import open_target
from hil.verdict.findings import failed
from hil.verdict.validation import validate
from model.units import shipped_units

FIRMWARE = {"paper": "pre"}
"""What a unit runs; the newest for the rest."""


@pytest.mark.parametrize("unit", shipped_units())
def test_a_full_staircase_is_within_limits(unit):
    with open_target(unit=unit, firmware=FIRMWARE.get(unit), homed=True) as target:
        result = validate(target, ["staircase"])
    assert [finding.sentence for finding in failed(result.findings)] == []
    assert len(result.findings) > 50
