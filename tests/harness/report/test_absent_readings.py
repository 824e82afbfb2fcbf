"""Every reading may be withheld, not measurable, or gone with its whole subject: page, text and files say so."""

import io
import math
import re
from dataclasses import replace

import pytest
from rich.console import Console

from hil.checks import JUDGED
from hil.recordings.output import json_text
from hil.report.beside_paper import compared, table, text_rows
from hil.report.page import render_report
from hil.report.results import checks_json
from hil.report.text import run_text
from hil.verdict.findings import failed

ABSENT, NAN = "absent", "NaN"
FIELDS = {"session": "whole_run", "driver": "driver", "alike": "alike"}
"""Results of a validation that are of no experiment, with their fields."""


def without(measured, how, metrics):
    """The readings with some metrics absent or NaN on every subject."""
    return {
        subject: {
            name: math.nan if name in metrics else value
            for name, value in row.items()
            if how == NAN or name not in metrics
        }
        for subject, row in measured.items()
    }


def with_result(validation, name, result):
    if name in validation.results:
        return replace(validation, results={**validation.results, name: result})
    return replace(validation, **{FIELDS[name]: result})


def numbers(validation):
    """Every table and file of a run."""
    files = checks_json(validation)
    beside = compared(validation)
    tables = [text_rows(validation), () if beside is None else table(beside)]
    return json_text(files) + repr(tables)


def shown(validation):
    """Everything that a person or a program reads of a run."""
    page, said = render_report(validation), io.StringIO()
    console = Console(width=80, file=said, markup=False, highlight=False)
    for line in run_text(validation, "out/report.html"):
        console.print(line)
    visible = re.sub(r"<script.*?</script>|<style.*?</style>", "", page, flags=re.DOTALL)
    return visible + said.getvalue() + numbers(validation)


def test_a_complete_run_of_a_good_hand_is_within_limits_and_says_no_nan(validated):
    assert [finding.sentence for finding in failed(validated.findings)] == []
    assert math.isfinite(validated.wall_seconds)
    assert not re.search(r"\bnan\b", shown(validated))


@pytest.mark.parametrize("how", [ABSENT, NAN])
def test_every_reading_may_be_absent_or_nan(validated, how):
    """One at a time in tables and files; all at once, and failing, on page and terminal too."""
    spoiled = validated
    for check, result in validated.judged.items():
        names = {metric.name for metric in JUDGED[check].metrics}
        for name in names:
            one = replace(result, measured=without(result.measured, how, {name}))
            assert not re.search(r"\bnan\b", numbers(with_result(validated, check, one))), (check, name)
        failing = tuple(replace(finding, passed=False) for finding in result.findings)
        every = replace(result, measured=without(result.measured, how, names), findings=failing)
        spoiled = with_result(spoiled, check, every)
    assert not re.search(r"\bnan\b", shown(spoiled))


def test_a_whole_subject_may_be_absent(validated):
    empty = validated
    for check, result in validated.judged.items():
        for subject in result.measured:
            left = {name: row for name, row in result.measured.items() if name != subject}
            numbers(with_result(validated, check, replace(result, measured=left)))
        empty = with_result(empty, check, replace(result, measured={}))
    shown(empty)
