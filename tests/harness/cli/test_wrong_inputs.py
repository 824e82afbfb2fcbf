"""Whatever is wrong with an option, a file, a place or a port: one clear line, the right code, and nothing lost."""

import os
import subprocess
import sys
from pathlib import Path

import mujoco
import pytest
from click.testing import CliRunner
from wrong_inputs import cases, filled, make_files

from aero.whole_file import write_whole
from firmware_emulator.firmware.nvs import Nvs
from hil.cli import main
from train.evaluation import figures

ALLOWED_CODES = {"option": {2}, "file": {2}, "output": {2}, "device": {2, 3}}
"""Bad usage, or no hand at a port."""


@pytest.fixture(scope="module")
def names(tmp_path_factory):
    return make_files(tmp_path_factory.mktemp("wrong"))


@pytest.mark.parametrize("case", tuple(cases()), ids=lambda case: f"{case.line}-{case.wrong}")
def test_a_wrong_input_gets_one_clear_line(case, names, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    before = kept(names["IN"])
    arguments = [filled(word, case.wrong, names) for word in case.line.split()]
    result = CliRunner().invoke(main, arguments)
    assert result.exit_code in ALLOWED_CODES[case.kind], result.output
    assert "Traceback" not in result.output
    errors = [line for line in result.output.splitlines() if line.startswith("Error: ")]
    assert errors == result.output.splitlines()[-1:]
    assert filled(case.named, "", names) in errors[0]
    assert kept(names["IN"]).items() >= before.items()
    assert list(tmp_path.iterdir()) == []


def kept(folder):
    """Every file of a folder, with its size and the time of its last change."""
    return {
        path: (path.lstat().st_size, path.lstat().st_mtime_ns) for path in Path(folder).iterdir() if not path.is_dir()
    }


def test_an_opengl_that_cannot_be_loaded_is_bad_usage(tmp_path):
    """MuJoCo loads it on being imported, so that it takes a process of its own."""
    command = [sys.executable, "-m", "hil.cli", "validate", "--dry-run"]
    environment = os.environ | {"MUJOCO_GL": "none", "PYTHONPATH": str(Path(__file__).parents[3])}
    ran = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    assert ran.returncode == 2
    assert ran.stderr.startswith("Error: MUJOCO_GL=none: ")
    assert ran.stderr.count("\n") == 1


@pytest.mark.parametrize("lacking", ["imageio", "OpenGL"])
@pytest.mark.parametrize("command", ["evaluate", "train"])
def test_a_video_that_cannot_be_made_is_refused_before_any_work(command, lacking, tmp_path, monkeypatch):
    def no_context(*_):
        raise RuntimeError("no display")

    if lacking == "imageio":
        monkeypatch.setattr(figures, "find_spec", lambda name: None)
    monkeypatch.setattr(mujoco, "Renderer", no_context)
    result = CliRunner().invoke(main, [command, "--video", "--out", str(tmp_path / "out")])
    assert result.exit_code == 2
    assert result.output.startswith("Error: --video")
    assert list((tmp_path / "out").iterdir()) == []


def test_a_link_in_place_of_a_result_is_replaced_and_not_followed(tmp_path):
    victim = tmp_path / "victim"
    victim.write_text("kept")
    for name in ("report.html", "state.json", f".state.json.{os.getpid()}", f".{os.getpid()}.report.html"):
        (tmp_path / name).symlink_to(victim)
    write_whole(tmp_path / "report.html", "new")
    victim.write_text("{}")
    Nvs(tmp_path / "state.json").store_extend(0, 1)
    assert victim.read_text() == "{}"
    assert (tmp_path / "report.html").read_text() == "new"
    assert not (tmp_path / "report.html").is_symlink()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["report.html", "state.json", "victim"]


def test_a_result_that_cannot_be_written_whole_leaves_the_old_one(tmp_path, monkeypatch):
    path = tmp_path / "checks.json"
    path.write_text("old")
    with pytest.raises(UnicodeEncodeError):
        write_whole(path, "new \udc80")
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]
