"""`-v` and `--log-file` show and keep what is logged; without them the terminal shows none of it."""

import logging
import subprocess
import sys

import pytest
from click.testing import CliRunner
from full_disk import available, full_disk

from hil.cli import main
from hil.cli.command_table import commands
from hil.cli.logs import LogFile

LINE = "asked again"
NOISY = ["validate", "--only", "presence", "--zeros", "ideal"]
NOISY += ["--fault", "reply_lost=0.2", "--fault", "board_restart@1"]
"""Requests are asked again, which is INFO, and the board restarts, which is a WARNING."""


def run(folder, *options):
    return CliRunner().invoke(main, [*NOISY, "--out", str(folder / "out"), *options])


def test_nothing_is_logged_to_the_terminal_unless_asked_for(tmp_path):
    """The board restarts while it homes, before any recording takes the warning."""
    restarting = ["validate", "--only", "presence", "--fault", "board_restart@0.5", "--out", str(tmp_path / "out")]
    command = [sys.executable, "-m", "hil.cli", *restarting]
    ran = subprocess.run(command, capture_output=True, text=True, check=False)
    assert ran.returncode == 3
    assert "the board has restarted" not in ran.stderr
    assert "(it printed its boot text)" not in ran.stderr


def test_v_shows_the_log_and_a_file_keeps_it(tmp_path):
    path = tmp_path / "run.log"
    path.write_text("an earlier run\n")
    shown = run(tmp_path, "-v", "--log-file", str(path))
    lines = path.read_text().splitlines()
    assert lines[0] == "an earlier run"
    assert LINE in lines[1]
    assert "INFO aero.link" in lines[1]
    assert shown.exit_code == 1
    assert any("WARNING aero.link" in line for line in lines)
    assert shown.stderr.count(LINE) == sum(LINE in line for line in lines)
    assert not [handler for handler in logging.getLogger("aero").handlers if isinstance(handler, logging.FileHandler)]


def test_a_log_file_that_cannot_be_written_is_one_line(tmp_path):
    refused = run(tmp_path, "--log-file", str(tmp_path / "missing" / "run.log"))
    assert refused.exit_code == 2
    assert "run.log" in refused.output
    assert not (tmp_path / "out").exists()


@pytest.mark.skipif(not available, reason="needs a limit on the size of files")
def test_a_log_file_on_a_full_disk_is_said_once_and_ends_nothing(tmp_path, capsys):
    path = tmp_path / "run.log"
    with full_disk(100):
        handler = LogFile(path)
        for i in range(100):
            handler.handle(logging.makeLogRecord({"msg": f"line {i}"}))
        handler.close()
    said = capsys.readouterr().err
    assert said.count("\n") == said.count(f"the log in {path} ends here, the command continues") == 1
    assert path.read_text().startswith("line 0\nline 1\n")


@pytest.mark.parametrize("name", ["doctor", "firmware", "faults"])
def test_every_command_has_the_options_once(name):
    command = main.get_command(None, name)
    command = main.get_command(None, name)
    assert name in commands()
    assert [option.name for option in command.params].count("log_file") == 1
