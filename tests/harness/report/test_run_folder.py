"""A second run in the folder of another replaces it; it never adds to it, and never ends a case that was begun."""

import json
from pathlib import Path

import pytest
from click.testing import CliRunner

from aero.exit_code import Exit
from hil.cli import main
from hil.report.run_folder import DATA, recordings_in


def invoke(*words):
    return CliRunner().invoke(main, list(map(str, words)))


def validated(folder, *names, fault=None):
    faults = () if fault is None else ("--fault", fault)
    return invoke("validate", *(word for name in names for word in ("--only", name)), *faults, "--out", folder)


def content(folder):
    return {path.relative_to(folder): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.fixture(scope="module")
def twice(tmp_path_factory):
    """Return a folder with a healthy run, after a faulty one of more experiments, and a user's file."""
    folder = tmp_path_factory.mktemp("run")
    assert validated(folder, "presence", "audit", fault="motor_dead:ring").exit_code == Exit.OUT_OF_LIMITS
    assert (folder / "case.json").is_file()
    (folder / "notes.txt").write_text("cable 3")
    (folder / "step-1").mkdir()
    (folder / "step-1" / "audit.mcap").write_bytes((folder / "audit.mcap").read_bytes())
    second = validated(folder, "presence")
    assert second.exit_code == 0, second.output
    assert "are replaced" in second.output
    return folder


def test_nothing_is_left_of_the_earlier_run(twice):
    assert {path.name for path in twice.iterdir()} == {
        "presence.mcap", "session.mcap", "checks.json", "measured.csv", "report.html", "notes.txt",
    }  # fmt: skip


@pytest.mark.parametrize(
    ("words", "code"),
    [("report RUN --out OUT.html", 0), ("baseline RUN OUT", 0), ("diagnose RUN", 2)],
)
def test_every_reader_of_the_folder_sees_the_second_run(twice, tmp_path, words, code):
    ended = invoke(*(word.replace("RUN", str(twice)).replace("OUT", str(tmp_path / "new")) for word in words.split()))
    assert ended.exit_code == code, ended.output
    assert "FAIL" not in ended.output
    assert "ing finger" not in ended.output


@pytest.mark.parametrize("change", [{"answers": {"Does it move?": "y"}}, {"steps": [{"unknown": 1}]}])
def test_a_case_that_was_begun_is_not_replaced(tmp_path, change):
    assert validated(tmp_path, "presence", fault="servo_missing:ring").exit_code == Exit.OUT_OF_LIMITS
    case = tmp_path / "case.json"
    case.write_text(json.dumps(json.loads(case.read_text()) | change))
    before = content(tmp_path)
    ended = validated(tmp_path, "presence")
    assert ended.exit_code == Exit.USAGE
    assert "case" in ended.output
    assert content(tmp_path) == before


def test_a_hand_that_cannot_be_opened_leaves_the_earlier_run(twice):
    before = content(twice)
    ended = invoke("validate", "--hil", "/dev/ttyNoSuchHand", "--out", twice)
    assert ended.exit_code == Exit.NO_HAND
    assert content(twice) == before


def test_what_is_read_as_a_run_is_replaced_as_one(tmp_path):
    for name in DATA:
        (tmp_path / name).touch()
    assert {Path(path).name for path in recordings_in(tmp_path)} == {name for name in DATA if name.endswith(".mcap")}
