"""Every experiment passes on a good hand, and measures what a hand with a known property has."""

import json

import numpy as np
import pytest

from aero.errors import LinkTimeoutError
from hil.checks import DEFAULT, EXPERIMENTS
from hil.checks.shared.experiment import record
from hil.emulated.any_hand import open_target
from hil.recordings.output import json_text
from hil.report.results import checks_json
from hil.verdict.findings import failed
from hil.verdict.validation import validate

SOME = ("presence", "audit")
"""All of them are run, on any hand, by `tests/hil`."""


@pytest.fixture(scope="module")
def results():
    """One run of the quickest experiments on the default hand."""
    with open_target(seed=1) as target:
        return validate(target, SOME)


def test_the_limits_of_an_experiment_are_compared_with_what_it_measured(results):
    assert {name for name in SOME if results.results[name].findings} == set(SOME)
    assert results.passed
    assert results.end.finding is None


def test_what_was_measured_can_be_written(results):
    written = json.loads(json_text(checks_json(results)))
    assert written["passed"] is True
    assert set(written["measured"]) == {*SOME, "session", "driver", "alike"}


def test_the_audit_takes_no_sign_from_the_map(monkeypatch):
    """A map that is wrong in every direction changes nothing that the audit says about signs."""
    with open_target(seed=1) as target:
        recording = record(EXPERIMENTS["audit"], target)
        good = EXPERIMENTS["audit"].measure(recording)
    monkeypatch.setattr("hil.checks.audit.check.map_of", lambda header: _Backwards())
    bad = EXPERIMENTS["audit"].measure(recording)
    assert {name: row["followed"] for name, row in good.items()} == {name: row["followed"] for name, row in bad.items()}
    assert {name: row["pull"] for name, row in good.items()} == {name: row["pull"] for name, row in bad.items()}


class _Backwards:
    class window:  # noqa: N801 - stands in for an attribute
        @staticmethod
        def spans_counts():
            return np.full(7, 7)


def test_a_board_that_falls_silent_ends_the_run_with_the_drivers_words(monkeypatch):
    with open_target() as target:

        def silence():
            raise LinkTimeoutError("emulated: no reply to GET_POS. The board may be homing.")

        monkeypatch.setattr(target.hand, "read_codes", silence)
        result = validate(target, ["presence", "audit"])
    assert result.results == {}
    assert "may be homing" in result.end.finding.meaning
    assert not result.passed


# Of the default hand, tests/harness/report has a complete run; the limits are those of homed hands.
@pytest.mark.slow
@pytest.mark.parametrize(("firmware", "side"), [("pre", "right"), ("0.1.5", "left"), ("0.2.0", "right")])
def test_the_suite_is_green_on_the_measured_hand(side, firmware):
    with open_target(unit="reference", side=side, firmware=firmware, homed=True) as target:
        result = validate(target, DEFAULT)
    assert [finding.sentence for finding in failed(result.findings)] == []
