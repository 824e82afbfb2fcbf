"""The report's page, without any network: plots are drawn, zoom, and follow a finding's link."""

from dataclasses import replace

import pytest

from hil.checks import DEFAULT
from hil.emulated.any_hand import open_target
from hil.report.page import render_report
from hil.verdict.findings import failed
from hil.verdict.validation import validate

CHARTS = "document.querySelectorAll('{} .u-over').length"
FIRST = "document.querySelector('#first-plot').charts[0]"


def drag(tab, first, last):
    """Drag over parts of the first plot."""
    box = tab.locator("#first-plot .u-over").first.bounding_box()
    tab.mouse.move(box["x"] + first * box["width"], box["y"] + 20)
    tab.mouse.down()
    tab.mouse.move(box["x"] + last * box["width"], box["y"] + 20)
    tab.mouse.up()


@pytest.fixture(scope="module")
def tab(opened, tmp_path_factory):
    with open_target(seed=3) as target:
        validated = validate(target, (*DEFAULT, "short_staircase", "repeatability"))
    result = validated.results["staircase"]
    spoiled = [replace(f, passed=f.check != "friction" or f.subject != "ring", excess=3.0) for f in result.findings]
    results = {**validated.results, "staircase": replace(result, findings=tuple(spoiled))}
    folder = tmp_path_factory.mktemp("browser")
    (folder / "report.html").write_text(render_report(replace(validated, results=results)), encoding="utf-8")
    assert failed(spoiled)
    with opened(f"file://{folder / 'report.html'}") as tab:
        tab.wait_for_function(CHARTS.format("#first-plot"))
        yield tab
        assert not tab.errors
        assert [request for request in tab.requests if not request.startswith("file:")] == []


def test_the_first_plot_has_both_fingers_on_one_time_axis_in_three_rows(tab):
    assert tab.evaluate(CHARTS.format("#first-plot")) == 3
    assert {"Ring, position", "Middle, position"} <= set(tab.evaluate(f"{FIRST}.series.map((one) => one.label)"))
    starts = [
        column["start"] - column["zero"]
        for column in tab.evaluate("document.querySelector('#first-plot').plot.columns")
    ]
    assert tab.evaluate(f"{FIRST}.scales.x.min") == pytest.approx(min(starts))


def test_a_click_on_a_head_sorts_what_was_measured(tab):
    table = "document.querySelector('#run-staircase .sortable')"
    shown = f"[...{table}.tBodies[0].rows].map((row) => row.cells[2].dataset.value).filter(Boolean).map(Number)"
    for direction in (1, -1):
        tab.evaluate(f"{table}.tHead.rows[0].cells[2].click()")
        values = tab.evaluate(shown)
        assert values == sorted(values, reverse=direction < 0)
    assert len(values) > 20


def test_the_values_under_the_cursor_are_shown(tab):
    tab.evaluate(f"{FIRST}.setCursor({{ left: 100, top: 10 }})")
    said = tab.evaluate("document.querySelector('#first-plot .u-legend').innerText")
    assert "% of window" in said
    assert "position" in said


def test_dragging_zooms_every_row_of_the_column(tab):
    scale = FIRST + ".scales.x"
    before = tab.evaluate(f"{scale}.max - {scale}.min")
    drag(tab, 0.2, 0.5)
    tab.wait_for_function(f"{scale}.max - {scale}.min < {0.5 * before}")
    other = "document.querySelector('#first-plot').charts[2].scales.x"
    assert tab.evaluate(f"{other}.max - {other}.min") == pytest.approx(0.3 * before, rel=0.1)


def test_a_findings_link_opens_its_experiment_at_its_seconds(tab):
    tab.evaluate("document.querySelector('a[data-show]').click()")
    assert tab.evaluate("document.querySelector('#run-staircase').open")
    tab.wait_for_function(CHARTS.format("#plot-staircase"))
    assert tab.evaluate("document.querySelector('#plot-staircase').plot.columns[0].channels") == [2]


def test_any_channels_can_be_chosen(tab):
    tab.evaluate("document.querySelectorAll('#plot-staircase input')[5].click()")
    assert tab.evaluate("document.querySelector('#plot-staircase').plot.columns[0].channels") == [2, 5]
    assert "CMC" in tab.evaluate("document.querySelector('#plot-staircase .u-legend').innerText")
