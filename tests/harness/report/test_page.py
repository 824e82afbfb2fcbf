"""The report says the verdict first, shows every number, and loads nothing."""

import re
from dataclasses import replace
from html.parser import HTMLParser

import pytest
from synthetic import staircase

from hil.experiments.staircase import EXPERIMENT as STAIRCASE
from hil.experiments.staircase.tracking import staircase_metrics
from hil.judging.findings import Finding
from hil.judging.judged_run import Result, Validation
from hil.judging.paper_figures import PAPER_TEXT
from hil.report.page import render_report
from hil.report.plots import as_svg, panels, validation_figure

GOOD = Finding("rise_hand_ms", "ring", True, "50 ms", "at most 70 ms", "logs", "slow <servo>", "look")
BAD = Finding("tracking_rms", "index", False, "1.2 mm", "at most 0.9 mm", "paper", "A loose cable.", "Tighten it.")


@pytest.fixture(scope="module")
def recording():
    return staircase(levels=4)


@pytest.fixture(scope="module")
def spoiled_page(recording):
    return page(recording, [GOOD, BAD])


def page(recording, findings):
    result = Result(recording, STAIRCASE.measure(recording), tuple(findings))
    return render_report(Validation({"staircase": result}, None, 1.5))


class Elements(HTMLParser):
    def __init__(self):
        super().__init__()
        self.references, self.figures, self.tags = [], [], []

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        attrs = dict(attrs)
        self.references += [attrs[name] for name in ("src", "href", "xlink:href", "data") if name in attrs]
        if tag == "figure":
            self.figures.append(attrs["id"])


def test_the_verdict_comes_first_and_failures_say_what_to_do(spoiled_page):
    body = spoiled_page[spoiled_page.index("<body>") :]
    assert body.index("Out of limits") < body.index("A loose cable.") < body.index("Tighten it.") < body.index("<table")
    assert "1 of 2 checks failed" in body
    assert "slow &lt;servo&gt;" not in body[: body.index("<details>")]


def test_a_good_hand_has_no_failures(recording):
    html = page(recording, [GOOD])
    assert "Within limits" in html
    assert "What failed" not in html


def test_nothing_is_loaded_from_anywhere(recording, spoiled_page):
    parser = Elements()
    parser.feed(html := spoiled_page)
    assert all(reference.startswith("#") for reference in parser.references)
    assert not {"script", "link", "img", "iframe"} & set(parser.tags)
    assert not re.search(r"url\((?!#)|@import", html)
    assert parser.figures == list(panels(recording))


def test_each_channel_stands_beside_the_paper(recording, spoiled_page):
    html = spoiled_page
    rows = staircase_metrics(recording)
    for row in rows.values():
        assert f"{row.tracking_rms:.2f}" in html
    for paper in ("26.79", "44.45", "0.63", "1871.00", "0.11"):
        assert f"paper {paper}" in html


def test_the_same_recording_draws_the_same_picture(recording):
    draw = panels(recording)["index"]
    assert as_svg(draw) == as_svg(draw)


def test_the_figure_has_the_papers_nine_panels(recording):
    figure = validation_figure(recording)
    titles = [axes.get_title("left") for axes in figure.axes if axes.get_title("left")]
    assert titles[:7] == ["Index", "Middle", "Ring", "Pinky", "Thumb abduction", "Thumb CMC flexion", "Thumb flexor"]
    assert titles[7:] == ["One step, index", "One step, thumb CMC flexion"]


def test_the_papers_text_figures_have_a_row_where_they_were_measured_or_cannot_be(spoiled_page):
    html = spoiled_page
    for figure in PAPER_TEXT:
        assert (figure.name in html) == (figure.experiment in ("", "staircase")), figure.name
    assert "needs a force gauge" in html
    assert html.count("not measured") == 3


def test_each_limit_stands_beside_its_number(spoiled_page):
    html = spoiled_page
    row = html[html.index('Tracking RMS"') :]
    assert row.index("paper 0.45") < row.index("at most 0.9 mm") < row.index("</td>")


def test_a_run_that_was_broken_off_says_so_and_shows_what_it_had(recording):
    cut = replace(recording, header=replace(recording.header, finished=False, duration_s=12.5))
    stopped = Finding(
        "staircase", "hand", False, "broken off", "run to its end", "a person", "It was stopped.", "Again."
    )
    html = render_report(Validation({}, stopped, 1.0, broken_off=(cut,)))
    assert "Broken off" in html
    assert "staircase after 12.5 s" in html
    assert "Out of limits" not in html
    assert html.count("<figcaption>") == len(cut.series)


def test_nothing_to_report_is_an_error():
    with pytest.raises(ValueError, match="nothing to report"):
        render_report(Validation({}, BAD, 0.0))
