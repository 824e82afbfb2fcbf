"""Everything that was measured, in words, on the page and as CSV."""

import csv
import io
import math

from hil.report.measured import measured_csv, readings_of
from hil.verdict.judged_run import Result


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
