"""The command line with nothing but what every installation has."""

import subprocess

import pytest

from hil.cli.command_table import commands

pytestmark = pytest.mark.slow


def test_help_of_a_command_without_its_extra_is_one_line_that_names_it(installed):
    """Each command says what it is for and which extra it needs."""
    lines = {}
    for name in ("campaign", "view", "doctor"):
        program = installed("-e .") / "aero-hil"
        helped = subprocess.run([program, name, "--help"], capture_output=True, text=True, check=False)
        assert helped.returncode == 0, helped.stderr
        assert helped.stderr == ""
        lines[name] = helped.stdout.splitlines()
    assert lines["doctor"][0].startswith("Usage: aero-hil doctor ")
    for name in ("campaign", "view"):
        (line,) = lines[name]
        command = commands()[name]
        assert line.startswith(f"{command.summary} `aero-hil {name}` needs the extra `{command.extra}`")
