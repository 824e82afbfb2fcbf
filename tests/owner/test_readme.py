"""The README's owner section, word for word, but for what makes and uses a twin of the hand."""

import shutil
from pathlib import Path

import pytest
from owner_section import as_run, owner_commands, run, scripts, with_a_twin

from hil.recordings.mcap_file import read_recording

COMMANDS = [command for command in owner_commands() if not with_a_twin(command)]

pytestmark = pytest.mark.slow


def test_help_and_dry_run(port, folder):
    assert run(["aero-hil", "--help"], folder).returncode == 0
    shown = run(["aero-hil", "validate", "--hil", port, "--dry-run"], folder)
    assert shown.returncode == 0, shown.stderr
    assert "guarded" in shown.stdout


@pytest.mark.parametrize("command", COMMANDS)
def test_the_owner_section_works_as_it_is_written(port, folder, command):
    """In order: what one command writes, the next reads."""
    ran = run(as_run(command, port), folder)
    assert ran.returncode == 0, f"{command}\n{ran.stdout[-3000:]}\n{ran.stderr[-3000:]}"


def test_what_was_left_can_be_looked_at_again(port, folder):
    results = folder / "validation" / "latest"
    recordings = sorted(str(path) for path in results.glob("*.mcap"))
    assert read_recording(Path(recordings[0])).header.started
    assert run(["aero-hil", "report", *recordings, "--out", "again.html"], folder).returncode == 0
    assert run(["aero-hil", "diff", str(results / "audit.mcap"), str(results / "audit.mcap")], folder).returncode == 0
    assert run(["aero-hil", "baseline", str(results), "mine"], folder).returncode == 0
    assert run(["aero-hil", "replay", str(results / "session.mcap")], folder).returncode == 0
    assert shutil.which("aero-hil", path=scripts()["PATH"])
