"""What begins in the run has its time; what was there before has none."""

from dataclasses import replace

import pytest
from synthetic import held

from aero.channels import Channel
from aero.safety import SafetyReason, SafetyStopError
from hil.report.evidence import first_plot, first_seen
from hil.verdict.findings import Finding
from hil.verdict.judged_run import Result, Validation
from hil.verdict.run_end import FINISHED, EndKind, RunEnd

BAD = Finding("holding_current", "ring", False, "2.2 A", "at most 1.5 A", "test", "Friction.", "Free it.")
GOOD = replace(BAD, passed=True)


def result(name, started, finding):
    made = held(name, [[0] * 7, [9000] * 7], 1.0)
    return Result(replace(made, header=replace(made.header, started=started, duration_s=9.0)), {}, (finding,))


def run(audit=GOOD, holding=BAD):
    # In the order of their names, as `aero-hil report FOLDER/*.mcap` gives them.
    holding, audit = result("holding", "2026-01-01T12:00:09", holding), result("audit", "2026-01-01T12:00:00", audit)
    return Validation({"holding": holding, "audit": audit}, FINISHED, 1.0)


def test_what_is_off_later_has_the_time_before_it():
    assert first_seen(run()) == "in holding, after 9 s of experiments whose checks all passed"


def test_what_is_off_from_the_start_has_no_time():
    assert not first_seen(run(audit=BAD))
    assert not first_seen(run(holding=GOOD))


@pytest.mark.parametrize("reason", SafetyReason)
def test_the_first_plot_of_a_stop_has_the_quantity_that_stopped_it(reason):
    cut = held("staircase", [[0] * 7, [9000] * 7], 1.0)
    end = RunEnd(EndKind.STOPPED, "staircase", "hot", SafetyStopError("hot", reason, Channel.RING), (cut,))
    plot = first_plot(Validation({}, end, 1.0), {})
    assert ("temperature" in plot.plot.rows) is (reason is SafetyReason.TEMPERATURE)
