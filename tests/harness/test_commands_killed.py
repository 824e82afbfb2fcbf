"""Long work broken off at random moments: what was said to be kept is kept, and the exit code says how it ended.

`KILLED=20 pytest -s -m slow tests/harness/test_commands_killed.py` is the table of docs/commands.md.
"""

import json
import os
import random
import shutil
import signal
import subprocess
import sys

import pytest
from click.testing import CliRunner

from hil.cli import main
from model.units import load_unit
from train.campaign.store import opened

pytestmark = [pytest.mark.slow, pytest.mark.skipif(os.name != "posix", reason="needs signals")]

MOMENTS = int(os.environ.get("KILLED", "1"))
PATIENCE_S = 240.0
ENDINGS = {"SIGINT": {130, -signal.SIGINT}, "SIGTERM": {143, -signal.SIGTERM}, "SIGKILL": {-signal.SIGKILL}}
"""Exit codes of docs/commands.md; a signal that comes before Python has reached the command ends it as signals do."""
LINES = {
    "campaign": "campaign --healthy 4 --only presence --workers 2 --out kept",
    "calibrate": "calibrate recorded.mcap --workers 2 --out unit.toml",
    "evaluate": "evaluate --on hands --units 8 --seconds 2 --out kept",
}
LATEST_S = {"campaign": 15.0, "calibrate": 20.0, "evaluate": 25.0}


def kept_by(name, folder, code):
    """Look at what a command has left, as its help and docs/commands.md promise; return what it was."""
    if name == "campaign":
        if not (folder / "kept" / "campaign.duckdb").exists():
            return "nothing yet"
        with opened(folder / "kept", read_only=True) as store:
            return f"{len(list(store.outcomes()))} outcomes"
    if name == "calibrate":
        unfinished = folder / "unit.unfinished.toml"
        if not unfinished.exists():
            return "no unit"
        assert load_unit(f"unfinished:{unfinished}").hand
        return "an unfinished unit"
    found = folder / "kept" / "evaluation.json"
    return f"{len(json.loads(found.read_text())['results'])} results" if found.exists() else "no evaluation"


def gone(group):
    """Return whether a process group has ended; a worker whose parent was killed does so by itself."""
    for _ in range(100):
        try:
            os.killpg(group, 0)
        except ProcessLookupError:
            return True
        signal.sigtimedwait([], 0.2)
    return False


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """A recording that calibration can use."""
    path = tmp_path_factory.mktemp("recorded") / "recorded.mcap"
    line = f"record --excite steps --channel index --scale 0.3 --out {path}"
    result = CliRunner().invoke(main, line.split())
    assert result.exit_code == 0, result.output
    return path


@pytest.mark.parametrize("moment", range(MOMENTS))
@pytest.mark.parametrize("ending", ENDINGS)
@pytest.mark.parametrize("name", LINES)
def test_what_was_kept_is_whole_and_the_ending_is_said(name, ending, moment, tmp_path, recorded):
    shutil.copy(recorded, tmp_path)
    after_s = random.Random(f"{name} {ending} {moment}").uniform(0.2, LATEST_S[name])
    command = subprocess.Popen(
        [sys.executable, "-m", "hil.cli", *LINES[name].split()], cwd=tmp_path,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True,
    )  # fmt: skip
    try:
        command.wait(after_s)
    except subprocess.TimeoutExpired:
        command.send_signal(getattr(signal, ending))
    _, said = command.communicate(timeout=PATIENCE_S)
    kept = kept_by(name, tmp_path, command.returncode)
    print(f"{name}, {ending} after {after_s:.1f} s: {command.returncode}, {kept}, {said.splitlines()[-1:]}")
    assert command.returncode in ENDINGS[ending] | {0}, said[-2000:]
    assert "Traceback" not in said or command.returncode == -signal.SIGINT, said[-2000:]
    if command.returncode in {130, 143} and said:
        assert said.splitlines()[-1] in {"Error: interrupted", "Error: terminated"}
    assert gone(command.pid)
    if name == "campaign":  # the same command goes on
        with opened(tmp_path / "kept") as store:
            before = store.keys()
        again = CliRunner().invoke(main, LINES[name].replace("kept", str(tmp_path / "kept")).split())
        assert again.exit_code == 0, again.output
        with opened(tmp_path / "kept", read_only=True) as store:
            assert before <= store.keys()
            assert len(store.keys()) == 4
