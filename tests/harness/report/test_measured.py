"""Everything that was measured, in words, on the page and as CSV."""

import csv
import io
import math
from pathlib import Path

from hil.report.measured import FORMAT, measured_csv, readings_of
from hil.verdict.judged_run import Result

ROOT = Path(__file__).parents[3]


def test_readings_have_words_and_units(validated):
    measured = {"index": {"friction": 0.25, "slack": math.nan}, "hand": {"something_new": 2.0}}
    found = {
        one.metric: one
        for one in readings_of("staircase", Result(validated.results["staircase"].recording, measured, ()))
    }
    assert found["friction"].text == "0.25 A"
    assert found["friction"].words == "friction"
    assert found["something_new"].words == "something new"
    assert {one.text for one in found.values() if math.isnan(one.value)} == {"not measurable"}


def test_the_table_holds_every_number_of_a_run(validated):
    rows = list(csv.DictReader(io.StringIO(measured_csv(validated.judged))))
    for name, result in validated.judged.items():
        for subject, numbers in result.measured.items():
            for metric, value in numbers.items():
                (row,) = [r for r in rows if (r["experiment"], r["subject"], r["metric"]) == (name, subject, metric)]
                assert row["value"] == ("" if math.isnan(value) else repr(float(value)))
                assert row["words"]


COLUMNS = {1: "experiment subject metric words value unit format"}
"""Columns of `measured.csv` by version; a change needs a new version."""


def test_columns_are_those_of_the_version_and_the_page_has_them(validated):
    columns = measured_csv(validated.judged).splitlines()[0].split(",")
    assert " ".join(columns) == COLUMNS[FORMAT]
    page = (ROOT / "docs" / "commands.md").read_text().partition("## Files for other programs")[2].partition("\n## ")[0]
    assert all(f"`{name}`" in page for name in columns)
    assert f"Version {FORMAT}" in page
