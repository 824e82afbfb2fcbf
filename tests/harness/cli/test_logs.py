"""`-v` shows what is logged; without it the terminal shows none of it."""

import logging
import subprocess
import sys

import pytest
from click.testing import CliRunner

from hil.cli import main
from hil.cli.command_table import commands

LINE = "asked again"
NOISY = ["validate", "--only", "presence", "--zeros", "ideal"]
NOISY += ["--fault", "reply_lost=0.2", "--fault", "board_restart@1"]
"""Requests are asked again, which is INFO, and the board restarts, which is a WARNING."""


def run(folder, *options):
    return CliRunner().invoke(main, [*NOISY, "--out", str(folder / "out"), *options])


@pytest.mark.slow
def test_nothing_is_logged_to_the_terminal_unless_asked_for(tmp_path):
    """The board restarts while it homes, before any recording takes the warning."""
    restarting = ["validate", "--only", "presence", "--fault", "board_restart@0.5", "--out", str(tmp_path / "out")]
    command = [sys.executable, "-m", "hil.cli", *restarting]
    ran = subprocess.run(command, capture_output=True, text=True, check=False)
    assert ran.returncode == 3
    assert "the board has restarted" not in ran.stderr
    assert "(it printed its boot text)" not in ran.stderr


def test_v_shows_the_log_until_the_command_ends(tmp_path):
    shown = run(tmp_path, "-v")
    assert shown.exit_code == 1
    assert "INFO aero.link" in next(line for line in shown.stderr.splitlines() if LINE in line)
    assert "WARNING aero.link" in shown.stderr
    assert all(type(handler) is logging.NullHandler for handler in logging.getLogger("aero").handlers)


@pytest.mark.parametrize("name", ["doctor", "firmware", "faults"])
def test_every_command_has_the_option_once(name):
    command = main.get_command(None, name)
    command = main.get_command(None, name)
    assert name in commands()
    assert [option.name for option in command.params].count("verbose") == 1
