"""The report says the verdict first, shows every number, and loads nothing."""

import base64
import json
import re
import zlib
from dataclasses import replace
from html import unescape
from html.parser import HTMLParser

import numpy as np
import pytest
from synthetic import staircase

import hil
from aero.channels import Channel
from hil.checks import EXPERIMENTS
from hil.checks.shared.signals import find_steps
from hil.checks.staircase.tracking import staircase_metrics
from hil.report.page import render_report
from hil.verdict.diagnosis import NOTHING, Diagnosis, NextStep
from hil.verdict.findings import Finding, NotJudgedReason, Withheld
from hil.verdict.judged_run import Result, Validation
from hil.verdict.part import Part
from hil.verdict.parts import Suspect
from hil.verdict.run_end import FINISHED, EndKind, RunEnd
from hil.verdict.validation import validate

GOOD = Finding(
    "rise_hand_ms", "ring", True, "50 ms", "at most 70 ms", "logs", "slow <servo>", "look", experiment="staircase"
)
BAD = Finding(
    "tracking_rms", "index", False, "1.2 mm", "at most 0.9 mm", "paper", "A loose cable.", "Tighten it.",
    experiment="staircase", excess=3.0,
)  # fmt: skip
OTHER = replace(BAD, check="friction", subject="pinky", measured="2 A")


@pytest.fixture(scope="module")
def recording():
    return staircase(levels=4)


@pytest.fixture(scope="module")
def spoiled_page(recording):
    return page(recording, [GOOD, BAD])


FILES = {"staircase": "runs/staircase 1.mcap", "session": "session.mcap"}


def page(recording, findings, files=FILES, *, end=FINISHED, diagnosis=NOTHING, withheld=()):
    result = Result(recording, EXPERIMENTS["staircase"].measure(recording), tuple(findings), withheld)
    return render_report(Validation({"staircase": result}, end, 1.5, diagnosis=diagnosis), files)


class Elements(HTMLParser):
    def __init__(self, html):
        super().__init__()
        self.references, self.figures, self.tags, self.ids, self.shows = [], {}, [], [], []
        self.channels, self.folded = {}, {}
        self.feed(html)

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        attrs = dict(attrs)
        self.references += [attrs[name] for name in ("src", "href", "xlink:href", "data") if name in attrs]
        if "id" in attrs:
            self.ids.append(attrs["id"])
        if tag == "figure" and "id" in attrs:
            self.figures[attrs["id"]] = json.loads(attrs["data-plot"])
        if "data-show" in attrs:
            self.shows.append(json.loads(attrs["data-show"]))
        if "data-channel" in attrs:
            self.channels[attrs["data-channel"]] = attrs["class"].split()
        if tag == "details" and "id" in attrs:
            self.folded[attrs["id"]] = "open" not in attrs


def test_the_verdict_comes_first_then_the_plot_the_evidence_other_findings_and_the_rest(recording):
    suspects = {Suspect(Part.SERVO, Channel.INDEX): 0.5, Suspect(Part.DIGIT, Channel.INDEX): 0.5}
    diagnosis = Diagnosis(suspects, ("the index is off",), (BAD,), (OTHER,), step=NextStep("Pull at it."))
    html = page(recording, [GOOD, BAD, OTHER], diagnosis=diagnosis)
    body = html[html.index("<body>") :]
    order = [
        "Out of limits: index finger", "Index finger: ", "Suspected: servo of the index",
        "2 of 3 checks failed.", 'id="first-plot"',
        "<b>Do this.</b> Pull at it.", "<b>Index finger: tracking rms 1.2 mm",
        'id="findings"', "<b>Pinky finger: friction 2 A",
        'id="appendix"', '<details id="checks">',
    ]  # fmt: skip
    places = [body.index(text) for text in order]
    assert places == sorted(places)
    assert "slow &lt;servo&gt;" not in body[: body.index('id="appendix"')]


def test_every_channel_is_in_the_picture_with_its_verdict(spoiled_page):
    wanted = {channel.label: ["channel", "none"] for channel in Channel}
    wanted |= {"ring": ["channel", "pass"], "index": ["channel", "fail"]}
    assert Elements(spoiled_page).channels == wanted


@pytest.mark.parametrize("part", [Part.DRIVER, Part.USB, Part.SUPPLY, Part.COMPUTER])
def test_what_is_no_fault_of_a_finger_paints_none_red(recording, part):
    diagnosis = Diagnosis({Suspect(part): 1.0}, ("a clue",), (BAD,))
    html = page(recording, [GOOD, BAD], diagnosis=diagnosis)
    assert Elements(html).channels["index"] == ["channel", "none"]
    assert f"not judged: its failures point to: {part.value}" in html


def test_the_finger_that_a_check_of_the_hand_is_about_is_red(recording):
    diagnosis = Diagnosis({Suspect(Part.DIGIT, Channel.RING): 1.0}, ("a clue",))
    assert Elements(page(recording, [GOOD, BAD], diagnosis=diagnosis)).channels["ring"] == ["channel", "fail"]


def test_the_first_plot_has_the_failed_channel_beside_a_healthy_one_and_marks_the_moment(recording, spoiled_page):
    plot = Elements(spoiled_page).figures["first-plot"]
    bad, healthy = plot["columns"]
    assert (bad["channels"], healthy["channels"]) == ([Channel.INDEX], [Channel.MIDDLE])
    assert plot["rows"] == ["position", "error", "current"]
    assert bad["at"] == EXPERIMENTS["staircase"].measure(recording)["index"]["worst_residual_at_s"]
    assert bad["start"] < bad["at"] < bad["end"] < healthy["end"]
    assert healthy["at"] is None


def unpacked(html):
    return json.loads(zlib.decompress(base64.b64decode(html.split('id="readings">')[1].split("<")[0])))


def test_the_page_carries_every_sample(recording, spoiled_page):
    series = unpacked(spoiled_page)["series"]["staircase"]
    for name, scale in (("hand", 1e3), ("currents", 1.0)):
        found = series[name]
        np.testing.assert_allclose(1e-3 * np.cumsum(found["t"]), recording[name].times, atol=6e-4)
        values = found["scale"] * np.cumsum(found["v"], axis=1).T
        np.testing.assert_allclose(values, scale * recording[name].values, atol=0.6 * found["scale"])


def test_every_link_leads_somewhere(spoiled_page):
    found = Elements(spoiled_page)
    inside = {reference[1:] for reference in found.references if reference.startswith("#")}
    outside = {reference for reference in found.references if not reference.startswith("#")}
    assert inside <= set(found.ids)
    assert outside == {"runs/staircase%201.mcap", "session.mcap"}
    assert {"finding-1", "plot-staircase"} <= inside


def test_a_finding_leads_to_the_seconds_and_the_channel_that_show_it(recording, spoiled_page):
    own = find_steps(recording["command"].times, recording["command"].values)[:8]
    (show,) = Elements(spoiled_page).shows
    assert show == {"channels": [Channel.INDEX], "start": own[0].start, "end": own[-1].end}
    assert f"staircase, {own[0].start:.1f} to {own[-1].end:.1f} s, worst at" in spoiled_page


def test_a_good_hand_has_no_findings(recording):
    html = page(recording, [GOOD])
    assert "Within limits" in html
    assert not {"findings", "diagnosis"} & set(Elements(html).ids)


def test_nothing_is_loaded_from_anywhere(spoiled_page):
    found = Elements(spoiled_page)
    assert not {"link", "img", "iframe"} & set(found.tags)
    assert not re.search(r"url\((?!#)|@import|fetch\(|XMLHttpRequest|<script[^>]* src", spoiled_page)
    assert list(found.figures) == ["first-plot", "plot-staircase"]
    assert len(found.ids) == len(set(found.ids))


def test_what_was_not_judged_is_grey_with_its_reason_in_one_line(recording):
    late = [Withheld("staircase", "rise_hand_ms", c.label, "rise time", NotJudgedReason.HELD_UP, 0.08) for c in Channel]
    html = page(recording, [GOOD], withheld=tuple(late))
    assert "1 kind of reading not judged: this computer was held up for 80 ms" in html
    assert "rise time (staircase): index finger, middle finger" in html
    assert "1 checks passed, 7 not judged." in html


def test_each_channel_stands_beside_the_paper(recording, spoiled_page):
    html = spoiled_page
    rows = staircase_metrics(recording)
    for row in rows.values():
        assert f"{row['tracking_rms']:.2f}" in html
    for paper in ("26.79", "44.45", "0.63", "1871.00", "0.11"):
        assert f"paper {paper}" in html


def aborted(recording):
    return replace(recording, header=replace(recording.header, finished=False, duration_s=12.5))


def test_a_run_that_was_aborted_says_so_and_shows_its_last_seconds(recording):
    html = render_report(Validation({}, RunEnd(EndKind.INTERRUPTED, "staircase", cut=(aborted(recording),)), 1.0))
    assert "Aborted" in html
    assert "aborted after 12.5 s" in html
    assert "Out of limits" not in html
    figures = Elements(html).figures
    assert list(figures) == ["first-plot", "plot-staircase"]
    end = recording["codes"].times[-1]
    assert {(column["start"], column["end"]) for column in figures["first-plot"]["columns"]} == {(end - 6.0, end)}


def test_a_busy_host_gives_no_verdict(recording):
    html = page(recording, [GOOD], end=RunEnd(EndKind.HOST_BUSY, "staircase", "It was late three times"))
    assert "Not judged" in html
    assert "Out of limits" not in html


@pytest.mark.parametrize("fault", ["current_wrong:ring=severe", "servo_hot:ring=severe", "host_stalls=severe"])
def test_the_head_leaves_the_advice_to_the_next_step(fault):
    """A stop by the guard, a failed gate and a busy computer said two things to do."""
    with hil.emulate(faults=(fault,), guarded=True) as target:
        run = validate(target, ["presence", "audit", "excursion"])
    said = unescape(render_report(run))
    [end] = re.findall(r'<p class="end">(.*?)</p>', said)
    assert said.count("Do this.") == 1
    assert run.end.finding.remedy not in end
    assert not re.search(r"\b([Ll]ook|[Tt]ry|[Rr]epair|[Cc]ontinue|[Cc]lose|[Cc]heck) ", end)
