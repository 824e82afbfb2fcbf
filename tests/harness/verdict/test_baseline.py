"""What has become worse since a hand's own baseline, on figures made by hand."""

import json

import pytest

from hil.recordings.errors import UnusableFileError
from hil.verdict.baseline import LARGEST_BYTES, Baseline, load, regressions, store

HAND = {"side": "right", "firmware": "0.2.0", "unit": "reference", "hand_id": "", "commit": "abc"}

BEFORE = {
    "staircase": {
        "ring": {"worst_percent": 2.0, "rise_hand_ms": 50.0, "friction": 0.2, "take_up": 1.0},
        "index": {"worst_percent": 10.0, "rise_hand_ms": 100.0, "friction": 1.0, "take_up": 20.0},
    },
    "presence": {"index": {"idle_current": 0.1}, "ring": {"idle_current": 1.0}},
    "holding": {"index": {"holding_current": 1.0}, "ring": {"holding_current": 0.5}},
}


def baseline(measured):
    return Baseline("mine", HAND, measured)


@pytest.mark.parametrize(
    ("experiment", "subject", "metric", "most"),
    [
        ("staircase", "ring", "worst_percent", 3.0),  # by 1 % of range, or 0.3 of 2 %
        ("staircase", "ring", "rise_hand_ms", 65.0),  # by 15 ms, or 0.2 of 50
        ("staircase", "index", "rise_hand_ms", 120.0),  # by 15 ms, or 0.2 of 100
        ("staircase", "ring", "friction", 0.32),  # by 0.12 A, or 0.3 of 0.2
        ("staircase", "index", "take_up", 24.0),  # by 2 mm, or 0.2 of 20
        ("presence", "index", "idle_current", 0.3),  # by 0.2 A, or 0.5 of 0.1
    ],
)
@pytest.mark.parametrize("sign", [1, -1])
def test_a_figure_may_grow_by_its_tolerance_and_no_more(experiment, subject, metric, most, sign):
    for value, passed in ((most - 0.005, True), (most + 0.005, False), (0.0, True)):
        (finding,) = regressions(baseline(BEFORE), {experiment: {subject: {metric: sign * value}}})
        assert finding.passed is passed
        assert finding.subject == subject
        assert finding.check == f"{metric} against the baseline"
    assert f"was {BEFORE[experiment][subject][metric]:.4g}" in finding.measured
    assert finding.expected == f"at most {most:.4g}"


def test_only_what_both_measured_is_compared():
    now = {"holding": {"pinky": {"holding_current": 9.0}, "index": {"warming": 99.0}}, "audit": {"ring": {"pull": 9.0}}}
    assert regressions(baseline(BEFORE), now) == ()
    assert regressions(baseline({}), BEFORE) == ()


def results(folder, measured):
    folder.mkdir()
    (folder / "checks.json").write_text(json.dumps({"hand": HAND, "passed": True, "measured": measured}))
    return folder


def test_figures_and_recordings_are_kept_and_read(tmp_path):
    found = results(tmp_path / "run", {"holding": {"index": {"warming": 2, "note": "text", "creep_percent": None}}})
    (found / "holding.mcap").write_bytes(b"recording")
    (found / "report.html").write_text("page")
    store(found, tmp_path / "new" / "mine")
    assert sorted(path.name for path in (tmp_path / "new" / "mine").iterdir()) == ["checks.json", "holding.mcap"]
    assert load(tmp_path / "new" / "mine").measured == {"holding": {"index": {"warming": 2}}}
    with pytest.raises(FileExistsError, match="exists already"):
        store(found, tmp_path / "new" / "mine")
    with pytest.raises(FileNotFoundError, match=r"no checks\.json"):
        store(tmp_path / "new", tmp_path / "other")


@pytest.mark.parametrize("value", [True, [1.0], {}])
def test_a_figure_that_is_no_number_is_refused(tmp_path, value):
    with pytest.raises(ValueError, match=r"warming is .*, not a number"):
        load(results(tmp_path / "run", {"holding": {"index": {"warming": value}}}))


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"measured": []}', '{"measured": {"holding": 1}}', "[" * 100_000])
def test_a_file_of_something_else_is_no_baseline(tmp_path, text):
    (tmp_path / "checks.json").write_text(text)
    with pytest.raises(ValueError, match="not a baseline"):
        load(tmp_path)


def test_no_file_and_one_of_more_than_16_mib_are_no_baseline(tmp_path):
    with pytest.raises(ValueError, match="not a baseline"):
        load(tmp_path)
    assert LARGEST_BYTES == 16 * 1024 * 1024
    good = json.dumps({"hand": HAND, "measured": {}})
    (tmp_path / "checks.json").write_text(good + " " * (LARGEST_BYTES - len(good)))
    assert load(tmp_path).measured == {}
    with (tmp_path / "checks.json").open("a") as stream:
        stream.write(" ")
    with pytest.raises(ValueError, match="16777216 are the limit"):
        load(tmp_path)


@pytest.mark.parametrize("text", ["-1e999", "NaN"])
def test_a_figure_that_is_not_finite_is_refused(tmp_path, text):
    """It would pass whatever comes."""
    figures = json.dumps({"hand": HAND, "measured": {"presence": {"index": {"idle_current": "VALUE"}}}})
    (tmp_path / "checks.json").write_text(figures.replace('"VALUE"', text))
    with pytest.raises(ValueError, match=r"is too large a number|is not a number of JSON"):
        load(tmp_path)


def test_a_figure_that_can_no_longer_be_measured_is_not_worse_and_does_not_pass():
    (finding,) = regressions(baseline(BEFORE), {"holding": {"ring": {"holding_current": float("nan")}}})
    assert not finding.passed
    assert finding.excess is None
    assert finding.measured == "not measurable, was 0.5"


@pytest.mark.parametrize(("field", "other"), [("side", "left"), ("firmware", "0.1.5"), ("unit", "plausible:7")])
def test_a_baseline_of_another_hand_is_refused(field, other):
    baseline({}).require_same(HAND)
    baseline({}).require_same({**HAND, "hand_id": "bench"})  # of which the baseline says nothing
    with pytest.raises(UnusableFileError, match=f"is of another hand: {field} {HAND[field]}, this is {other}"):
        baseline({}).require_same({**HAND, field: other})


def test_a_run_that_did_not_pass_is_stored_when_that_is_asked_for(tmp_path):
    found = results(tmp_path / "run", {})
    text = (found / "checks.json").read_text()
    (found / "checks.json").write_text(text.replace("true", "false"))
    with pytest.raises(UnusableFileError, match="did not pass"):
        store(found, tmp_path / "mine")
    store(found, tmp_path / "mine", force=True)
    assert load(tmp_path / "mine").hand == HAND


def test_a_baseline_that_does_not_say_whose_it_is_is_refused(tmp_path):
    (tmp_path / "checks.json").write_text('{"measured": {}}')
    with pytest.raises(UnusableFileError, match="identity of its hand"):
        load(tmp_path)
