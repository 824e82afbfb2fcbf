"""`aero-hil history` over the folders that validations left."""

import json
import shutil
from dataclasses import replace
from datetime import datetime, timedelta

import pytest
from click.testing import CliRunner

from hil.cli import main
from hil.emulated.any_hand import open_target
from hil.history.runs import of_hand, runs_in
from hil.recordings.errors import UnusableFileError
from hil.recordings.mcap_file import read_header, read_recording, write_recording
from hil.report.results import write_results
from hil.verdict.validation import validate

FIELDS = {"hand_id": "bench-left", "serial_number": "F412FA"}


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    """Six runs of one hand a week apart, of which the last has only a serial number, and one of another hand."""
    place = tmp_path_factory.mktemp("validation")
    first = place / "0"
    first.mkdir()
    with open_target(seed=3) as target:
        write_results(validate(target, ("presence",), folder=first), first)
    for number in range(6, -1, -1):
        folder = place / str(number)
        if number:
            shutil.copytree(first, folder)
        fields = FIELDS if number < 5 else {"serial_number": "F412FA"} if number == 5 else {"hand_id": "bench-right"}
        for path in folder.glob("*.mcap"):
            made = read_recording(path)
            started = datetime.fromisoformat(made.header.started) + timedelta(days=7 * number)
            write_recording(replace(made, header=replace(made.header, started=started.isoformat(), **fields)), path)
    (place / "latest").symlink_to("6")
    return place


def names(runs):
    return [run.folder.name for run in runs]


def changed(runs, **fields):
    """Return runs with header fields by the number of the run."""
    return [
        replace(run, header=replace(run.header, **{name: values[number] for name, values in fields.items()}))
        for number, run in enumerate(runs)
    ]


def test_a_serial_number_of_two_names_is_of_no_hand(folders):
    runs = changed(runs_in([folders])[0][:4], hand_id=["a", "b", "a", ""], serial_number=["0001"] * 4)
    chosen, doubtful = of_hand(runs, "a")
    assert names(chosen) == ["0", "2"]
    assert [folder.name for folder, _ in doubtful] == ["3"]
    with pytest.raises(UnusableFileError, match="of a, b"):
        of_hand(runs, "0001")


def test_a_run_of_the_other_side_is_left_out(folders):
    runs = changed(runs_in([folders])[0][:3], side=["right", "left", "left"])
    chosen, doubtful = of_hand(runs, "bench-left")
    assert names(chosen) == ["1", "2"]
    assert [folder.name for folder, _ in doubtful] == ["0"]


def test_a_rerun_of_a_case_and_a_copy_are_no_runs(folders, tmp_path):
    for copy in ("run", "baseline"):
        shutil.copytree(folders / "0", tmp_path / copy)
    (tmp_path / "run" / "case.json").write_text("{}")
    shutil.copytree(folders / "1", tmp_path / "run" / "step-1")
    (tmp_path / "run" / "case.json").rename(tmp_path / "run" / "step-1" / "other.json")
    (tmp_path / "run" / "checks.json").touch()
    assert len(runs_in([tmp_path])[0]) == 2
    (tmp_path / "run" / "case.json").touch()
    assert [folder.name for folder, _ in runs_in([tmp_path])[1]] == ["run"]
    assert len(runs_in([tmp_path])[0]) == 1


def test_an_empty_name_is_refused(folders, tmp_path):
    done = CliRunner().invoke(main, ["history", "", str(folders), "--out", str(tmp_path / "h.html")])
    assert done.exit_code == 2
    assert "hands there" in done.output


def test_each_run_is_found_once_in_the_order_of_its_date(folders):
    runs, refused = runs_in([folders, folders])
    assert not refused
    assert [run.folder.name for run in runs] == ["0", "1", "2", "3", "4", "5", "6"]
    assert names(of_hand(runs, "bench-left")[0]) == ["0", "1", "2", "3", "4", "5"]
    assert names(of_hand(runs, "bench-right")[0]) == ["6"]
    assert of_hand(runs, "") == ([], [])


def test_a_page_and_a_line(folders, tmp_path):
    done = CliRunner().invoke(main, ["history", "bench-left", str(folders), "--out", str(tmp_path / "h.html")])
    assert done.exit_code == 0, done.output
    assert "6 runs in 35 days, 0 drifting towards a limit" in done.output
    page = (tmp_path / "h.html").read_text()
    assert "bench-left: 6 runs" in page
    assert page.count("<svg") >= 7


def test_an_unknown_hand_is_one_line_with_the_known_ones(folders, tmp_path):
    done = CliRunner().invoke(main, ["history", "bench", str(folders), "--out", str(tmp_path / "h.html")])
    assert done.exit_code == 2
    assert "bench-left, bench-right" in done.output
    assert not (tmp_path / "h.html").exists()


HAND = {"hand": "right", "firmware": "0.2.0", "unit": "reference", "hand_id": ""}
FIGURES = ("1" * 400, "1e300", "NaN", "true", "[]", '{"a": 1}')


@pytest.mark.parametrize(
    "damage",
    [
        "{",
        json.dumps({"passed": True}),
        *(f'{{"hand": {json.dumps(HAND)}, "measured": {{"presence": {{"ring": {{"x": {one}}}}}}}}}' for one in FIGURES),
    ],
)
def test_a_damaged_run_is_left_out_with_its_reason(folders, tmp_path, damage):
    shutil.copytree(folders / "0", tmp_path / "runs" / "good")
    shutil.copytree(folders / "0", tmp_path / "runs" / "bad")
    (tmp_path / "runs" / "bad" / "checks.json").write_text(damage)
    runs, refused = runs_in([tmp_path / "runs"])
    assert [run.folder.name for run in runs] == ["good"]
    assert [folder.name for folder, _ in refused] == ["bad"]


def test_a_date_without_a_zone_leaves_one_run_out(folders, tmp_path):
    for number, name in enumerate(("good", "later", "bad")):
        shutil.copytree(folders / str(number), tmp_path / "runs" / name)
    path = tmp_path / "runs" / "bad" / "presence.mcap"
    made = read_recording(path)
    write_recording(replace(made, header=replace(made.header, started="2026-01-01T00:00:00")), path)
    done = CliRunner().invoke(
        main, ["history", "bench-left", str(tmp_path / "runs"), "--out", str(tmp_path / "h.html")]
    )
    assert done.exit_code == 0, done.output
    assert "left out" in done.output
    assert "2 runs" in done.output


def test_the_header_is_read_without_the_recording(folders):
    path = folders / "0" / "presence.mcap"
    assert replace(read_header(path), duration_s=0.0, finished=True) == replace(
        read_recording(path).header, duration_s=0.0, finished=True
    )
