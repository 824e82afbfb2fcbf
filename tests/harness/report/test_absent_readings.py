"""Every reading may be withheld, not measurable, or gone with its whole subject: page, text and files say so."""

import io
import json
import math
import re
from dataclasses import replace

import pytest
from rich.console import Console

from hil.checks import JUDGED
from hil.report.beside_paper import compared, table, text_rows
from hil.report.page import render_report
from hil.report.results import checks_json, metrics_json
from hil.report.text import run_text

METRICS = [(name, metric) for name, check in JUDGED.items() for metric in dict.fromkeys(m.name for m in check.metrics)]
ABSENT, NAN = "absent", "NaN"


def without(measured, metric, how):
    """The readings with one metric absent or NaN on every subject."""
    if how == ABSENT:
        return {subject: {k: v for k, v in row.items() if k != metric} for subject, row in measured.items()}
    return {subject: {k: math.nan if k == metric else v for k, v in row.items()} for subject, row in measured.items()}


def with_result(validation, name, result):
    if name in validation.results:
        return replace(validation, results={**validation.results, name: result})
    return replace(validation, **{"session": {"whole_run": result}, "driver": {"driver": result}}[name])


def shown(validation):
    """Everything that a person or a program reads of a run."""
    page = render_report(validation)
    said = io.StringIO()
    console = Console(width=80, file=said, markup=False, highlight=False)
    for line in run_text(validation, "out/report.html", console.width):
        console.print(line)
    files = [checks_json(validation), metrics_json(validation)]
    text = json.dumps(files, allow_nan=False) + said.getvalue()
    if (beside := compared(validation)) is not None:
        text += repr(table(beside))
    visible = re.sub(r"<script.*?</script>|<style.*?</style>", "", page, flags=re.DOTALL)
    return visible + text + repr(text_rows(validation))


def test_a_complete_run_says_no_nan(validated):
    assert not re.search(r"\bnan\b", shown(validated))


@pytest.mark.parametrize("how", [ABSENT, NAN])
@pytest.mark.parametrize(("check", "metric"), METRICS)
def test_a_reading_may_be_absent_or_nan(validated, check, metric, how):
    if (result := validated.judged.get(check)) is None:
        pytest.skip(f"{check} is not part of the run")
    spoiled = replace(result, measured=without(result.measured, metric, how))
    text = shown(with_result(validated, check, spoiled))
    assert not re.search(r"\bnan\b", text)


@pytest.mark.parametrize("check", JUDGED)
def test_a_whole_subject_may_be_absent(validated, check):
    if (result := validated.judged.get(check)) is None:
        pytest.skip(f"{check} is not part of the run")
    for subject in result.measured:
        left = {name: row for name, row in result.measured.items() if name != subject}
        shown(with_result(validated, check, replace(result, measured=left)))


def test_the_numbers_of_a_withheld_reading_are_null(validated):
    result = validated.results["staircase"]
    spoiled = replace(result, measured=without(result.measured, "rise_hand_ms", ABSENT))
    content = metrics_json(with_result(validated, "staircase", spoiled))
    assert {row["rise_hand_ms"] for row in content["channels"].values()} == {None}
