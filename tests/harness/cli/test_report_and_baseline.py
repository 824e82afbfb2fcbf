"""What one does with recordings: judge again, keep as a baseline."""

import dataclasses
import json
import os
from itertools import permutations

import numpy as np
import pytest
from click.testing import CliRunner
from synthetic import replaced

from hil.checks import EXPERIMENTS
from hil.cli import main
from hil.emulated.any_hand import open_target
from hil.recordings.errors import NotOneHandError
from hil.recordings.mcap_file import read_recording, write_recording
from hil.recordings.recording import DELAYS, delay_series
from hil.report.results import write_results
from hil.targets.delays import Delay, Loop
from hil.verdict.baseline import store
from hil.verdict.findings import MissingReadingError, NotJudgedReason, failed
from hil.verdict.judge import Judge
from hil.verdict.validation import judge_recordings, validate

NAMES = ("presence", "audit", "holding")


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """A folder as `aero-hil validate` leaves it."""
    out = tmp_path_factory.mktemp("results")
    with open_target(seed=3) as target:
        write_results(validate(target, NAMES, folder=out), out)
    return out


def invoke(*arguments):
    return CliRunner().invoke(main, [str(argument) for argument in arguments])


def test_judging_a_recording_again_gives_the_same_verdict(results, tmp_path):
    checks = json.loads((results / "checks.json").read_text())
    again = judge_recordings([read_recording(results / f"{name}.mcap") for name in (*NAMES, "session")])
    assert [finding["measured"] for finding in checks["findings"]] == [finding.measured for finding in again.findings]
    result = invoke("report", results / "audit.mcap", results / "holding.mcap", "--out", tmp_path / "r.html")
    assert result.exit_code == 0, result.output
    assert "Within limits" in (tmp_path / "r.html").read_text()


def test_a_spoiled_recording_is_judged_out_of_limits(results, tmp_path):
    audit = read_recording(results / "audit.mcap")
    codes = audit["codes"].values.copy()
    codes[:, 2] = 0
    write_recording(replaced(audit, "codes", codes), tmp_path / "dead.mcap")
    result = invoke("report", tmp_path / "dead.mcap", "--out", tmp_path / "r.html")
    assert result.exit_code == 1
    assert "Ring finger: motion after a nudge 0 % of a nudge" in (tmp_path / "r.html").read_text()


def cut_off(recording, path):
    """Write a recording as Ctrl-C or SIGKILL leave it."""
    header = dataclasses.replace(recording.header, finished=False, duration_s=0.0)
    write_recording(dataclasses.replace(recording, header=header), path)
    return path


@pytest.mark.parametrize(
    ("whole", "cut", "said"),
    [
        (("presence",), ("audit", "session"), "; the rest is within limits"),
        ((), ("audit",), "not judged, because incomplete: "),
        ((), ("session",), "no experiment began"),
    ],
)
def test_what_a_person_broke_off_never_looks_like_a_broken_hand(results, tmp_path, whole, cut, said):
    paths = [results / f"{name}.mcap" for name in whole]
    paths += [cut_off(read_recording(results / f"{name}.mcap"), tmp_path / f"{name}.mcap") for name in cut]
    result = invoke("report", *paths, "--out", tmp_path / "r.html")
    assert result.exit_code == 2, result.output
    assert said in result.output
    assert "out of limits" not in result.output


def test_a_recording_is_judged_without_the_file_of_its_unit(results, tmp_path):
    """It need not be on this machine, and is not opened because a recording names it."""
    audit = read_recording(results / "audit.mcap")
    pipe = tmp_path / "unit.toml"
    os.mkfifo(pipe)
    elsewhere = dataclasses.replace(audit.header, unit=str(pipe))
    write_recording(dataclasses.replace(audit, header=elsewhere), tmp_path / "carried.mcap")
    result = invoke("report", tmp_path / "carried.mcap", "--out", tmp_path / "r.html")
    assert result.exit_code == 0, result.output
    result = invoke("export", tmp_path / "carried.mcap", "--out", tmp_path / "e.mcap")
    assert result.exit_code == 0, result.output


def test_a_baseline_is_kept_and_not_overwritten(results, tmp_path):
    assert invoke("baseline", results, tmp_path / "mine").exit_code == 0
    assert (tmp_path / "mine" / "holding.mcap").is_file()
    again = invoke("baseline", results, tmp_path / "mine")
    assert again.exit_code == 2
    assert "exists already" in again.output


def test_the_same_hand_has_not_become_worse(results, tmp_path):
    store(results, tmp_path / "mine")
    with open_target(seed=8) as target:
        result = validate(target, NAMES, baseline=tmp_path / "mine")
    assert len(result.regressions) == 7 + 7
    assert failed(result.regressions) == ()


def test_a_baseline_of_another_hand_is_refused_before_anything_moves(results, tmp_path):
    store(results, tmp_path / "mine")
    line = "validate --unit plausible:7 --side left --only audit"
    result = invoke(*line.split(), "--baseline", tmp_path / "mine", "--out", tmp_path / "out")
    assert result.exit_code == 2
    assert "of another hand: side right, this is left" in result.output
    assert not (tmp_path / "out" / "audit.mcap").exists()


def test_two_recordings_of_one_experiment_or_of_two_hands_are_refused_by_name(results, tmp_path):
    audit = read_recording(results / "audit.mcap")
    holding = read_recording(results / "holding.mcap")
    write_recording(audit, tmp_path / "again.mcap")
    other = dataclasses.replace(holding.header, side="left", unit="plausible:7")
    write_recording(dataclasses.replace(holding, header=other), tmp_path / "left.mcap")
    for second, said in (("again.mcap", "are both of audit"), ("left.mcap", "are not of one hand")):
        for pair in permutations((results / "audit.mcap", tmp_path / second)):
            result = invoke("report", *pair, "--out", tmp_path / "r.html")
            assert result.exit_code == 2
            assert result.output.count("\n") == 1
            assert f"{pair[0]} and {pair[1]} {said}" in result.output
    assert not (tmp_path / "r.html").exists()


def test_without_bytes_the_link_and_the_driver_are_not_judged(results, tmp_path):
    for name, exit_code, said in (("audit", 0, "within limits"), ("session", 2, "nothing is judged")):
        recording = read_recording(results / f"{name}.mcap")
        judged = judge_recordings([dataclasses.replace(recording, wire=())])
        assert {one.why for one in judged.withheld} == {NotJudgedReason.NO_BYTES}
        assert not {"driver", "session"} & {finding.experiment for finding in judged.findings}
        write_recording(dataclasses.replace(recording, wire=()), tmp_path / f"{name}.mcap")
        result = invoke("report", tmp_path / f"{name}.mcap", "--out", tmp_path / "r.html")
        assert result.exit_code == exit_code
        assert said in result.output


def test_a_reading_that_a_check_no_longer_returns_is_a_defect(results, monkeypatch):
    def forgetful(recording):
        return {on: row if on != "ring" else {} for on, row in EXPERIMENTS["holding"].measure(recording).items()}

    holding = dataclasses.replace(EXPERIMENTS["holding"], measure=forgetful)
    recording = read_recording(results / "holding.mcap")
    with pytest.raises(MissingReadingError, match="holding did not measure"):
        Judge.of_recording(recording.header).experiment(holding, recording)


def test_a_reading_without_a_limit_says_so(results):
    recording = read_recording(results / "holding.mcap")
    judge = Judge.of_recording(recording.header)
    judge.limits = tuple(limit for limit in judge.limits if limit.metric != "holding_current")
    judged = judge.experiment(EXPERIMENTS["holding"], recording)
    assert {(one.metric, one.why) for one in judged.withheld} == {("holding_current", NotJudgedReason.NO_LIMIT)}


def test_a_dry_run_moves_nothing(monkeypatch, tmp_path):
    result = invoke("validate", "--dry-run", "--only", "audit", "--out", tmp_path / "out")
    assert result.exit_code == 0, result.output
    assert "will close by up to 20 % for about 9 s" in " ".join(result.output.split())
    assert "°C" in result.output
    assert not (tmp_path / "out").exists()


def test_everything_that_validate_wrote_is_judged_again_in_a_folder_that_is_made(results, tmp_path):
    out = tmp_path / "new" / "report.html"
    result = invoke("report", *sorted(results.glob("*.mcap")), "--out", out)
    assert result.exit_code == 0, result.output
    assert out.exists()


def test_what_a_busy_computer_recorded_has_no_verdict_when_it_is_judged_again_either(results, tmp_path):
    """Three recordings in which the program was held up for a tenth of the time."""
    for name in NAMES:
        recording = read_recording(results / f"{name}.mcap")
        every = np.arange(0.1, recording.header.duration_s, 0.1)
        late = delay_series([Delay(float(t), 0.01, Loop.PROGRAM) for t in every])
        write_recording(
            dataclasses.replace(recording, series={**recording.series, DELAYS: late}), tmp_path / f"{name}.mcap"
        )
    result = invoke("report", *sorted(tmp_path.glob("*.mcap")), "--out", tmp_path / "r.html")
    assert result.exit_code == 7
    assert "no time in 3 experiments can be judged: this computer was held up" in result.output


def test_a_recording_of_record_is_not_judged_and_one_line_says_so(results, tmp_path):
    audit = read_recording(results / "audit.mcap")
    header = dataclasses.replace(audit.header, experiment="excitation")
    write_recording(dataclasses.replace(audit, header=header), tmp_path / "excitation.mcap")
    result = invoke("report", tmp_path / "excitation.mcap", "--out", tmp_path / "new" / "r.html")
    assert result.exit_code == 2
    assert "was made by `aero-hil record` and is not judged" in result.output
    assert len(result.output.splitlines()) == 1
    assert not (tmp_path / "new").exists()


def test_a_defect_of_the_page_is_no_wrong_usage(results, tmp_path, monkeypatch):
    def broken(*_):
        raise KeyError("rise_hand_ms")

    monkeypatch.setattr("hil.cli.report.render_report", broken)
    result = invoke("report", results / "audit.mcap", "--out", tmp_path / "r.html")
    assert result.exit_code == 70
    assert "a defect of aero-hil" in result.output
    assert not (tmp_path / "r.html").exists()


def test_a_recording_of_an_unknown_experiment_is_one_line(results, tmp_path):
    known = read_recording(results / "audit.mcap")
    path = tmp_path / "unknown.mcap"
    write_recording(dataclasses.replace(known, header=dataclasses.replace(known.header, experiment="of-2040")), path)
    done = invoke("report", path, "--out", tmp_path / "report.html")
    assert done.exit_code == 2, done.output
    assert "unknown.mcap is of 'of-2040'" in done.output


HEADERS = {
    "commit": ("0" * 40, "1" * 40, r"not of one run: they were made at the commits"),
    "started": ("2024-05-01T10:00:00+02:00", "2026-05-01T10:00:00+02:00", "not of one run: they were made on"),
}


@pytest.mark.parametrize("field", HEADERS)
def test_recordings_of_one_hand_years_or_commits_apart_are_not_one_run(results, tmp_path, field):
    *values, said = HEADERS[field]
    recordings = [read_recording(results / f"{name}.mcap") for name in ("presence", "audit")]
    changed = [
        dataclasses.replace(recording, header=dataclasses.replace(recording.header, **{field: value}))
        for recording, value in zip(recordings, values, strict=True)
    ]
    with pytest.raises(NotOneHandError, match=said):
        judge_recordings(changed)


def test_the_name_of_a_folder_need_not_be_text(results, tmp_path):
    folder = tmp_path / "caf\udce9"
    folder.mkdir()
    (folder / "x.mcap").write_bytes((results / "audit.mcap").read_bytes())
    done = invoke("report", folder / "x.mcap", "--out", tmp_path / "report.html")
    assert done.exit_code in (0, 1), done.output
    assert "caf%E9/x.mcap" in (tmp_path / "report.html").read_text()
