"""OpenHTF test record of a run, for test-data platforms: a phase an experiment, measurements with units and limits.

A reading that was not judged is UNSET in a phase that may pass. An unmeasurable one is UNSET and its phase fails.
"""

import math
from collections.abc import Iterable, Mapping
from typing import Any

from hil.checks import JUDGED
from hil.checks.shared.experiment import reading
from hil.recordings.mcap_file import epoch_ns
from hil.recordings.recording import Header, Recording
from hil.targets.hand_spec import PHYSICAL
from hil.verdict.findings import failed
from hil.verdict.judged_run import Result, Validation
from hil.verdict.limits import Limit, load_limits
from hil.verdict.run_end import EndKind

UNITS = {
    "ms": ("millisecond", "C26"), "s": ("second [unit of time]", "SEC"), "mm": ("millimetre", "MMT"),
    "mrad": ("milliradian", "C25"), "A": ("ampere", "AMP"), "Hz": ("hertz", "HTZ"), "°C": ("degree Celsius", "CEL"),
    "%": ("percent", "P1"),
}  # fmt: skip
"""OpenHTF's name and UNECE code of a unit. Source: `openhtf.util.units`; other units have no code."""
LEVELS = {"info": 20, "warning": 30, "error": 40}
OPTIONS = {
    "timeout_s": None, "run_if": None, "requires_state": False, "force_repeat": False,
    "repeat_on_measurement_fail": False, "repeat_on_timeout": False, "repeat_limit": None, "run_under_pdb": False,
    "phase_name_case": "KEEP", "stop_on_measurement_fail": False,
}  # fmt: skip
"""Phase options of OpenHTF, at their defaults."""
NO_CODE = {"name": "", "docstring": None, "sourcecode": ""}


def openhtf_record(validation: Validation) -> dict[str, Any]:
    """Return the test record of a run.

    Raises:
        ValueError: the run has no recording.
    """
    header = validation.header
    if header is None:
        raise ValueError("no experiment began; there is nothing to export")
    limits = load_limits(header.firmware, guarded=bool(header.safety))
    phases = [_judged_phase(name, result, limits) for name, result in validation.judged.items()]
    phases += [_phase(cut, cut.header.experiment, "ERROR", {}) for cut in validation.end.cut]
    outcome, details = _outcome(validation)
    return {
        "dut_id": _dut_id(header),
        "start_time_millis": min(phase["start_time_millis"] for phase in phases),
        "end_time_millis": max(phase["end_time_millis"] for phase in phases),
        "outcome": outcome,
        "outcome_details": details,
        "marginal": False if outcome == "PASS" else None,
        "metadata": {
            "test_name": "aero-hil validate",
            "test_version": header.commit,
            "config": {"firmware": header.firmware, "side": header.side, "target": header.target, "unit": header.unit},
        },
        "phases": phases,
        **{name: [] for name in ("subtests", "branches", "diagnosers", "diagnoses")},
        "log_records": [record for one in _recordings(validation) for record in _log_records(one)],
        "station_id": header.host,
        "code_info": NO_CODE,
    }


def _recordings(validation: Validation) -> Iterable[Recording]:
    return (*(result.recording for result in validation.results.values()), *validation.end.cut)


def _dut_id(header: Header) -> str:
    """Return the serial number or name of the hand, or the unit and seed of an emulated one."""
    emulated = "" if header.unit == PHYSICAL else f"{header.unit} seed {header.seed}"
    return header.serial_number or header.hand_id or emulated or "UNKNOWN_DUT"


def _outcome(validation: Validation) -> tuple[str, list[dict[str, str]]]:
    if validation.end.kind is not EndKind.FINISHED:
        said = validation.end.reason or f"{validation.end.at} is incomplete"
        return "ERROR", [{"code": validation.end.kind.name, "description": said}]
    if not validation.findings:
        return "ERROR", [{"code": "NOT_JUDGED", "description": "no reading was judged"}]
    return "PASS" if validation.passed else "FAIL", []


def _judged_phase(name: str, result: Result, limits: Iterable[Limit]) -> dict[str, Any]:
    bounds = {
        (limit.metric, subject): limit for limit in limits if limit.experiment == name for subject in limit.subjects
    }
    rows = {
        f"{subject}.{metric.name}": _measurement(metric.name, subject, name, result, bounds)
        for metric in JUDGED[name].metrics
        for subject in metric.subjects
        if reading(result.measured, subject, metric.name) is not None or (metric.name, subject) in _withheld(result)
    }
    return _phase(result.recording, name, "FAIL" if failed(result.findings) else "PASS", rows)


def _withheld(result: Result) -> Mapping[tuple[str, str], str]:
    return {(one.metric, one.subject): one.reason for one in result.withheld}


def _measurement(
    name: str, subject: str, experiment: str, result: Result, bounds: Mapping[tuple[str, str], Limit]
) -> dict[str, Any]:
    metric, value = JUDGED[experiment].metric(name, subject), reading(result.measured, subject, name)
    finding = next((one for one in result.findings if (one.check, one.subject) == (name, subject)), None)
    reason = _withheld(result).get((name, subject), "")
    is_set = not reason and value is not None and math.isfinite(value)
    outcome = "UNSET" if not is_set else "PASS" if finding is None or finding.passed else "FAIL"
    limit = bounds.get((name, subject))
    long_name, code = UNITS.get(metric.unit, (metric.unit, None))
    said = f"not judged: {reason}" if reason else "" if is_set else "not measurable"
    return {
        "name": f"{subject}.{name}",
        "outcome": outcome,
        **({} if limit is None else {"validators": _validators(limit, metric.end_of_scale)}),
        "units": {"name": long_name, "code": code, "suffix": metric.unit},
        "docstring": ", ".join(filter(None, (metric.words, said))),
        **({"measured_value": value} if is_set else {}),
    }


def _validators(limit: Limit, end_of_scale: float) -> list[str]:
    """Return the bounds in the words of OpenHTF's `in_range`."""
    if limit.at_least == limit.at_most:
        return [f"x == {limit.at_least}"]
    low = f"{limit.at_least} <= " if math.isfinite(limit.at_least) else ""
    high = f" <= {limit.at_most}" if math.isfinite(limit.at_most) else ""
    return [f"{low}x{high}", *([f"x < {end_of_scale}"] if math.isfinite(end_of_scale) else [])]


def _phase(recording: Recording, name: str, outcome: str, measurements: Mapping[str, Any]) -> dict[str, Any]:
    start = epoch_ns(recording.header) // 10**6
    aborted = {"exc_type": "Incomplete", "exc_val": f"{name} did not run to its end", "exc_tb": ""}
    return {
        "measurements": dict(measurements),
        "options": {"name": name, **OPTIONS},
        "subtest_name": None,
        "start_time_millis": start,
        "end_time_millis": start + round(1e3 * recording.header.duration_s),
        "attachments": {},
        **{key: [] for key in ("diagnosers", "diagnosis_results", "failure_diagnosis_results")},
        "result": {"phase_result": aborted if outcome == "ERROR" else "CONTINUE"},
        "outcome": outcome,
        "marginal": False if outcome == "PASS" else None,
        "descriptor_id": list(JUDGED).index(name),
        "name": name,
        "codeinfo": NO_CODE,
    }


def _log_records(recording: Recording) -> Iterable[dict[str, Any]]:
    begin = epoch_ns(recording.header) // 10**6
    for event in recording.events:
        yield {
            "level": LEVELS[event.severity],
            "logger_name": "aero-hil",
            "source": recording.header.experiment,
            "lineno": 0,
            "timestamp_millis": begin + round(1e3 * event.t),
            "message": event.text,
        }
