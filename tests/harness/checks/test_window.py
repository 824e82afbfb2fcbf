"""The check of a window's ends: what is found of cable length and trims, and what no reading can show."""

from functools import cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from aero.channels import FINGERS
from hil.checks import EXPERIMENTS
from hil.checks.shared.experiment import record
from hil.checks.window.check import taken_up
from hil.emulated.any_hand import open_target
from hil.emulated.faults import parse_fault
from hil.verdict.findings import failed
from hil.verdict.validation import validate

WINDOW = EXPERIMENTS["window"]


@cache
def measured(fault=None, *, homed=False, firmware="main", hand="right", unit="plausible:5"):
    faults = [parse_fault(fault)] if fault else []
    with open_target(firmware=firmware, side=hand, unit=unit, seed=1, homed=homed, faults=faults) as target:
        return WINDOW.measure(record(WINDOW, target))


@pytest.mark.parametrize(
    ("hand", "firmware"),
    [
        ("left", "main"),
        *(pytest.param(*key, marks=pytest.mark.slow) for key in (("right", "main"), ("right", "0.1.5"))),
    ],
)
def test_a_cable_that_became_long_since_the_last_homing_leaves_slack(firmware, hand):
    how = {"firmware": firmware, "hand": hand}
    healthy, faulty = measured(**how), measured("cable_long:ring=7.6", **how)
    # 7.6 mm on a spool of 9 mm are 551 counts.
    assert faulty["ring"]["slack"] - healthy["ring"]["slack"] == pytest.approx(551, abs=70)
    assert faulty["middle"] == pytest.approx(healthy["middle"], abs=40)


@pytest.mark.slow
@pytest.mark.parametrize("fault", ["cable_long:ring=7.6", "cable_short:ring=7"])
def test_homing_makes_a_cables_length_invisible(fault):
    """It finds the zero at the closed stop, so that the same counts mean the same angles whatever the length."""
    healthy, faulty = measured(homed=True), measured(fault, homed=True)
    for finger in FINGERS:
        for name in ("slack", "left_closed", "window_moved"):
            assert faulty[finger.label][name] == pytest.approx(healthy[finger.label][name], abs=60)


@pytest.mark.parametrize(
    ("fault", "found"),
    [
        (None, set()),
        ("cable_short:index=7", {("left_closed", "index")}),
        *(
            pytest.param(*case, marks=pytest.mark.slow)
            for case in (
                ("cable_long:index=7.6", {("slack", "index")}),
                ("trim_left_in:index=40", {("window_moved", "index")}),
                # Of a homed hand, as the limits are: a cable off its spool is not found with the zeros of assembly.
                ("cable_snapped:index", {("slack", "index")}),
            )
        ),
    ],
)
def test_the_limits_name_what_is_wrong(fault, found):
    faults = [parse_fault(fault)] if fault else []
    with open_target(firmware="main", seed=1, homed=fault == "cable_snapped:index", faults=faults) as target:
        result = validate(target, ["window"]).judged["window"]
    assert found <= {(finding.check, finding.subject) for finding in failed(result.findings)}
    assert bool(failed(result.findings)) is bool(found)


@given(
    slack=st.integers(4, 30),
    spool=st.floats(0.02, 0.15),
    spring=st.floats(0.15, 0.8),
    rise=st.floats(0.0, 0.4),
)
def test_the_place_where_a_cable_begins_to_pull_is_found(slack, spool, spring, rise):
    wound = np.linspace(0.0, 1150.0, 36)
    pull = np.full(36, spool)
    pull[slack:] += spring + rise * np.linspace(0.0, 1.0, 36)[slack:]
    pull = np.maximum(pull, 0.0)
    if np.median(pull[-3:]) >= 0.2:
        assert taken_up(wound, pull) == pytest.approx(wound[slack], abs=40)
