"""The test record of a run has the keys, types and outcomes that OpenHTF itself writes for the same measurements."""

import json
import logging
import math
import signal
from dataclasses import replace

import pytest
from click.testing import CliRunner

from hil.checks import JUDGED
from hil.checks.shared.experiment import reading
from hil.cli import main
from hil.emulated.any_hand import open_target
from hil.emulated.faults import parse_fault
from hil.recordings.recording import Event
from hil.report.openhtf import LEVELS, UNITS, openhtf_record
from hil.report.results import write_results
from hil.verdict.findings import NotJudgedReason, Withheld
from hil.verdict.limits import load_limits
from hil.verdict.run_end import EndKind, RunEnd
from hil.verdict.validation import validate

pytest.importorskip("openhtf", reason="needs the extra `test`")
import openhtf as htf
from openhtf.output.callbacks.json_factory import OutputToJSON
from openhtf.util import units

signal.signal(signal.SIGINT, htf.Test.DEFAULT_SIGINT_HANDLER)
# OpenHTF replaced it when it was imported, for every other test of this process too.
VOLATILE = {"start_time_millis", "end_time_millis", "descriptor_id", "codeinfo", "code_info", "log_records", "config"}
"""Keys whose values differ between any two tests, or that describe the program of the test."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("run")


@pytest.fixture(scope="module")
def run(folder):
    """A hand with a torn cable, whose record has passed, failed, withheld and unmeasurable readings."""
    with open_target(faults=[parse_fault("cable_snapped:ring")], hand_id="bench-left") as target:
        made = validate(target, ("presence", "audit"), folder=folder)
    write_results(made, folder)
    presence = made.results["presence"]
    late = Withheld("presence", "temperature", "index", "temperature", NotJudgedReason.HELD_UP, 0.05)
    presence = replace(
        presence,
        findings=tuple(one for one in presence.findings if (one.check, one.subject) != ("temperature", "index")),
        withheld=(late,),
        recording=replace(presence.recording, events=(Event(0.5, "warning", "late"),)),
    )
    audit = made.results["audit"]
    measured = {subject: dict(row) for subject, row in audit.measured.items()}
    measured["middle"]["pull"] = math.nan
    unmeasured = tuple(
        replace(one, passed=False, excess=None) if (one.check, one.subject) == ("pull", "middle") else one
        for one in audit.findings
    )
    audit = replace(audit, measured=measured, findings=unmeasured)
    return replace(made, results={"presence": presence, "audit": audit})


class Below:
    """OpenHTF validator of a reading below the end of its scale."""

    def __init__(self, bound):
        self.bound = bound

    def __call__(self, value):
        return value < self.bound

    def __str__(self):
        return f"x < {self.bound}"


def bounded(measurement, limit, metric):
    """Return an OpenHTF measurement with a limit's bounds."""
    low, high = (bound if math.isfinite(bound) else None for bound in (limit.at_least, limit.at_most))
    measurement.in_range(low, high)
    return measurement.with_validator(Below(metric.end_of_scale)) if math.isfinite(metric.end_of_scale) else measurement


def phase_of(name, result, limits):
    """Return an OpenHTF phase that takes the same measurements as an experiment."""
    withheld = {(one.metric, one.subject) for one in result.withheld}
    declared, values, skipped = [], {}, []
    for metric in JUDGED[name].metrics:
        for subject in metric.subjects:
            value, key = reading(result.measured, subject, metric.name), f"{subject}.{metric.name}"
            if value is None and (metric.name, subject) not in withheld:
                continue
            unit = units.UNITS_BY_ALL.get(metric.unit) or units.UnitDescriptor(metric.unit, None, metric.unit)
            said = htf.Measurement(key).with_units(unit).doc(metric.words)
            for limit in limits:
                if (limit.experiment, limit.metric) == (name, metric.name) and subject in limit.subjects:
                    bounded(said, limit, metric)
            declared.append(said)
            if (metric.name, subject) in withheld:
                skipped.append(key)
            elif math.isfinite(value):
                values[key] = value

    @htf.PhaseOptions(name=name)
    @htf.measures(*declared)
    def phase(test):
        for key, value in values.items():
            test.measurements[key] = value
        for key in skipped:
            test.measurements.set_measurement_outcome_to_skipped(key)
        test.logger.warning("late")

    return phase


def executed(tmp_path, *phases):
    """Return the JSON record of an OpenHTF test."""
    test = htf.Test(*phases, test_name="aero-hil validate", test_version="commit")
    test.add_output_callbacks(OutputToJSON(str(tmp_path / "record.json")))
    test.execute(test_start=lambda: "bench-left")
    record = json.loads((tmp_path / "record.json").read_text())
    record["phases"] = [phase for phase in record["phases"] if phase["name"] != "trigger_phase"]
    return record


def stable(content, drop=VOLATILE):
    """Return a record without volatile values and docstrings, which only we extend by the reason of no value."""
    if isinstance(content, dict):
        return {key: None if key in (*drop, "docstring") else stable(value, drop) for key, value in content.items()}
    return [stable(one, drop) for one in content] if isinstance(content, list) else content


def shape(content):
    """Return the keys and types of a record."""
    if isinstance(content, dict):
        return {key: shape(value) for key, value in content.items()}
    return [shape(content[0])] if isinstance(content, list) and content else type(content).__name__


def test_the_record_is_what_openhtf_writes_for_the_same_measurements(run, tmp_path):
    limits = load_limits(run.header.firmware, guarded=False)
    theirs = executed(tmp_path, *(phase_of(name, result, limits) for name, result in run.judged.items()))
    ours = json.loads(json.dumps(openhtf_record(run)))
    outcomes = {m["outcome"] for phase in ours["phases"] for m in phase["measurements"].values()}
    assert outcomes == {"PASS", "FAIL", "UNSET"}
    own = {"station_id": None, "metadata": None}
    assert stable(ours) | own == stable(theirs) | own
    assert ours["metadata"].keys() == theirs["metadata"].keys()
    for key in ("start_time_millis", "end_time_millis", "code_info", "log_records", "station_id", "dut_id"):
        assert shape(ours[key]) == shape(theirs[key]), key
    for mine, other in zip(ours["phases"], theirs["phases"], strict=True):
        assert {key: shape(mine[key]) for key in VOLATILE & mine.keys()} == {
            key: shape(other[key]) for key in VOLATILE & other.keys()
        }


def test_a_reading_that_is_not_judged_passes_and_one_that_cannot_be_measured_fails(run):
    phases = {phase["name"]: phase for phase in openhtf_record(run)["phases"]}
    assert phases["presence"]["outcome"] == "PASS"
    withheld = phases["presence"]["measurements"]["index.temperature"]
    assert (withheld["outcome"], "measured_value" in withheld) == ("UNSET", False)
    assert "not judged: this computer was held up for 50 ms" in withheld["docstring"]
    assert phases["audit"]["outcome"] == "FAIL"
    assert "not measurable" in phases["audit"]["measurements"]["middle.pull"]["docstring"]


def test_an_experiment_that_was_cut_short_is_an_error_as_of_openhtf(run, tmp_path):
    cut = (run.results["audit"].recording,)
    ended = replace(
        run, results={"presence": run.results["presence"]}, end=RunEnd(EndKind.INCOMPLETE, "audit", cut=cut)
    )

    @htf.PhaseOptions(name="audit")
    def audit(test):
        raise RuntimeError

    ours, theirs = openhtf_record(ended), executed(tmp_path, audit)
    assert ours["outcome"] == theirs["outcome"] == "ERROR"
    assert shape(ours["outcome_details"]) == shape(theirs["outcome_details"])
    assert stable(ours["phases"][-1], VOLATILE | {"result"}) == stable(theirs["phases"][-1], VOLATILE | {"result"})
    assert shape(ours["phases"][-1]["result"]) == shape(theirs["phases"][-1]["result"])


def test_nothing_judged_never_passes(run):
    nothing = replace(run, results={}, driver=None, alike=None, whole_run=replace(run.whole_run, findings=()))
    assert openhtf_record(nothing)["outcome"] == "ERROR"


def test_units_are_those_of_openhtf():
    assert {suffix: (name, code) for suffix, (name, code) in UNITS.items()} == {
        suffix: units.UNITS_BY_SUFFIX[suffix][:2] for suffix in UNITS
    }


def test_export_of_a_folder_writes_the_record(run, folder):
    done = CliRunner().invoke(main, ["export", str(folder)])
    assert done.exit_code == 0, done.output
    record = json.loads((folder / "openhtf.json").read_text())
    assert f"{record['outcome']}, " in done.output
    assert (record["dut_id"], record["outcome"]) == ("bench-left", "FAIL")
    assert [phase["name"] for phase in record["phases"]][:2] == ["presence", "audit"]


def test_export_of_an_empty_folder_is_one_line(tmp_path):
    done = CliRunner().invoke(main, ["export", str(tmp_path)])
    assert done.exit_code == 2
    assert "holds no recording" in done.output
    assert not list(tmp_path.iterdir())


def test_levels_are_those_of_logging():
    assert {level: getattr(logging, level.upper()) for level in LEVELS} == LEVELS
