"""The report says the verdict first, shows every number, and loads nothing."""

import math
import re
from dataclasses import replace
from html.parser import HTMLParser
from xml.etree import ElementTree

import pytest
from hypothesis import given
from hypothesis import strategies as st
from synthetic import held, staircase

from aero.channels import Channel
from hil.checks import EXPERIMENTS
from hil.checks.shared.signals import find_steps
from hil.checks.staircase.tracking import staircase_metrics
from hil.report.beside_paper import table
from hil.report.chart_svg import TITLE, chart_svg
from hil.report.hand_picture import convex_hull, outline
from hil.report.page import render_report
from hil.report.plots import panels, validation_figure
from hil.verdict.findings import Finding
from hil.verdict.judged_run import Result, Validation
from hil.verdict.run_end import FINISHED, EndKind, RunEnd

GOOD = Finding("rise_hand_ms", "ring", True, "50 ms", "at most 70 ms", "logs", "slow <servo>", "look")
BAD = Finding("tracking_rms", "index", False, "1.2 mm", "at most 0.9 mm", "paper", "A loose cable.", "Tighten it.")


@pytest.fixture(scope="module")
def recording():
    return staircase(levels=4)


@pytest.fixture(scope="module")
def spoiled_page(recording):
    return page(recording, [GOOD, BAD])


FILES = {"staircase": "runs/staircase 1.mcap", "session": "session.mcap"}


def page(recording, findings, files=FILES, end=FINISHED):
    result = Result(recording, EXPERIMENTS["staircase"].measure(recording), tuple(findings))
    return render_report(Validation({"staircase": result}, end, 1.5), files)


class Elements(HTMLParser):
    def __init__(self, html):
        super().__init__()
        self.references, self.figures, self.tags, self.ids = [], [], [], []
        self.channels, self.folded = {}, {}
        self.feed(html)

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        attrs = dict(attrs)
        self.references += [attrs[name] for name in ("src", "href", "xlink:href", "data") if name in attrs]
        if "id" in attrs:
            self.ids.append(attrs["id"])
        if tag == "figure" and "id" in attrs:
            self.figures.append(attrs["id"])
        if "data-channel" in attrs:
            self.channels[attrs["data-channel"]] = attrs["class"].split()
        if tag == "details" and "id" in attrs:
            self.folded[attrs["id"]] = "open" not in attrs


def test_the_verdict_comes_first_and_failures_say_what_to_do(spoiled_page):
    body = spoiled_page[spoiled_page.index("<body>") :]
    order = ["Out of limits"]
    places = [body.index(text) for text in (*order, "1 of 2 checks failed", "A loose cable.", "<table")]
    assert places == sorted(places)
    assert "1 of 2 checks failed" in body
    assert "slow &lt;servo&gt;" not in body[: body.index('id="experiments"')]


def test_every_channel_is_in_the_picture_with_its_verdict(spoiled_page):
    wanted = {channel.label: ["channel", "none"] for channel in Channel}
    wanted |= {"ring": ["channel", "pass"], "index": ["channel", "fail"]}
    assert Elements(spoiled_page).channels == wanted


@pytest.mark.parametrize("side", ["right", "left"])
def test_the_thumb_is_drawn_on_the_side_of_the_hand(side):
    digits = outline(side).digits
    assert list(digits) == list(Channel)
    thumb, pinky = digits[Channel.THUMB_FLEXOR].points[-1][0], digits[Channel.PINKY].points[-1][0]
    assert (thumb > pinky) == (side == "right")


def turn(a, b, c):
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


PLACES = st.tuples(st.integers(-9, 9), st.integers(-9, 9))


@given(st.lists(PLACES, min_size=3, max_size=30).filter(lambda points: any(turn(*points[:2], p) for p in points)))
def test_a_hull_turns_left_at_every_corner_and_holds_every_point(points):
    hull = convex_hull(points)
    for a, b, c in zip(hull, hull[1:] + hull[:1], hull[2:] + hull[:2], strict=True):
        assert turn(a, b, c) > 0
        assert all(turn(a, b, point) >= 0 for point in points)


def test_every_link_leads_somewhere(spoiled_page):
    found = Elements(spoiled_page)
    inside = {reference[1:] for reference in found.references if reference.startswith("#")}
    outside = {reference for reference in found.references if not reference.startswith("#")}
    assert inside <= set(found.ids)
    assert outside == {"runs/staircase%201.mcap", "session.mcap"}
    assert {"findings", "paper", "run-staircase", "checks", "recordings"} <= inside


def test_a_finding_names_the_seconds_and_the_figure_that_show_it(recording, spoiled_page):
    finding = spoiled_page[spoiled_page.index('id="finding-1"') :]
    finding = finding[: finding.index("</div>")]
    own = find_steps(recording["command"].times, recording["command"].values)[:8]
    assert f"{own[0].start:.1f} to {own[-1].end:.1f} s, worst at" in finding
    assert 'href="#staircase-index"' in finding
    assert 'href="runs/staircase%201.mcap"' in finding


def test_a_page_without_recordings_links_to_none(recording):
    html = page(recording, [BAD], files={})
    assert all(reference.startswith("#") for reference in Elements(html).references)
    assert ".mcap" not in html


def test_a_good_hand_has_no_failures(recording):
    html = page(recording, [GOOD])
    assert "Within limits" in html
    assert "What failed" not in html


def test_what_is_healthy_is_folded_and_what_failed_is_not(recording):
    held_still = held("holding", [[0] * 7, [30000] * 7, [0] * 7], 1.0)
    results = {
        "holding": Result(held_still, {"index": {"creep_percent": 0.0}}, (GOOD,)),
        "audit": Result(held_still, {"index": {"followed": 0.0}}, (BAD,)),
        "staircase": Result(recording, EXPERIMENTS["staircase"].measure(recording), (GOOD,)),
    }
    html = render_report(Validation(results, FINISHED, 1.0))
    assert Elements(html).folded == {"run-holding": True, "run-audit": False, "run-staircase": False}


def test_nothing_is_loaded_from_anywhere(recording, spoiled_page):
    found = Elements(spoiled_page)
    assert not {"script", "link", "img", "iframe"} & set(found.tags)
    assert not re.search(r"url\((?!#)|@import", spoiled_page)
    assert found.figures == [f"staircase-{name}" for name in (*panels(recording), "currents")]
    own = [name for name in found.ids if name.startswith(("finding-", "run-", "why-", "staircase-"))]
    assert len(own) == len(set(own))


@pytest.mark.parametrize("style", ["prefers-color-scheme: dark", "@media print", "max-width: 860px"])
def test_the_page_follows_the_reader(spoiled_page, style):
    assert style in spoiled_page


def test_the_figures_follow_the_pages_colours(spoiled_page):
    figure = spoiled_page[spoiled_page.index('id="staircase-currents"') :]
    figure = figure[: figure.index("</figure>")]
    assert "var(--reading" in figure
    assert "fill: #ffffff" not in figure
    assert not re.search(r"(?<!, )#000000", figure)


def test_a_figure_far_from_the_papers_has_a_reason_unless_it_failed(recording):
    cmc = replace(BAD, check="excursion_hand", subject="thumb_cmc_flexion")
    told = page(recording, [replace(cmc, passed=True)])
    assert "meets the palm about half way" in told
    assert "meets the palm about half way" not in page(recording, [cmc])


@pytest.mark.parametrize(("ours", "told"), [(16.0, False), (7.4, True), (math.nan, False)])
def test_a_small_difference_needs_no_reason(recording, ours, told):
    """The paper's is 16.57 mm."""
    measured = EXPERIMENTS["staircase"].measure(recording)
    measured["thumb_cmc_flexion"]["excursion_hand"] = ours
    cmc = table(Result(recording, measured, ()))[Channel.THUMB_CMC_FLEXION]
    assert bool(cmc.cells[1].why) == told


def test_each_channel_stands_beside_the_paper(recording, spoiled_page):
    html = spoiled_page
    rows = staircase_metrics(recording)
    for row in rows.values():
        assert f"{row.tracking_rms:.2f}" in html
    for paper in ("26.79", "44.45", "0.63", "1871.00", "0.11"):
        assert f"paper {paper}" in html


def test_the_same_recording_draws_the_same_picture(recording):
    draw = panels(recording)["index"]
    assert chart_svg(draw()) == chart_svg(draw())


def test_the_figure_has_the_papers_nine_panels(recording):
    texts = ElementTree.fromstring(validation_figure(recording)).iter("{http://www.w3.org/2000/svg}text")
    titles = [text.text for text in texts if text.get("font-size") == str(TITLE)]
    assert titles[:7] == ["Index", "Middle", "Ring", "Pinky", "Thumb abduction", "Thumb CMC flexion", "Thumb flexor"]
    assert titles[7:] == ["One step, index", "One step, thumb CMC flexion"]


def test_the_papers_text_figures_have_a_row_where_they_were_measured_or_cannot_be(spoiled_page):
    html = spoiled_page
    for name, experiment in EXPERIMENTS.items():
        for figure in (figure for metric in experiment.metrics for figure in metric.published):
            assert (figure.figure in html) == (name == "staircase"), figure
    assert "needs a force gauge" in html
    assert html.count("not measured") == 3


def test_each_limit_stands_beside_its_number(spoiled_page):
    html = spoiled_page
    row = html[html.index('Tracking RMS"') :]
    assert row.index("paper 0.45") < row.index("at most 0.9 mm") < row.index("</td>")


def test_a_run_that_was_aborted_says_so_and_shows_what_it_had(recording):
    cut = replace(recording, header=replace(recording.header, finished=False, duration_s=12.5))
    html = render_report(Validation({}, RunEnd(EndKind.INTERRUPTED, "staircase", cut=(cut,)), 1.0))
    assert "Broken off" in html
    assert "staircase after 12.5 s" in html
    assert "Out of limits" not in html
    assert Elements(html).figures == [f"broken-staircase-{name}" for name in ("codes", "currents", "hand")]


def test_what_passed_in_a_run_that_was_aborted_has_passed_only_partly(recording):
    cut = replace(recording, header=replace(recording.header, finished=False))
    channels = Elements(page(recording, [GOOD, BAD], end=RunEnd(EndKind.INCOMPLETE, "staircase", cut=(cut,)))).channels
    assert (channels["ring"], channels["index"]) == (["channel", "partly"], ["channel", "fail"])


def test_nothing_to_report_is_an_error():
    with pytest.raises(ValueError, match="nothing to report"):
        render_report(Validation({}, RunEnd(EndKind.LINK, "presence"), 0.0))
