"""The command lists the catalogue."""

import json

from click.testing import CliRunner

from hil.emulated.cli.faults import faults
from hil.emulated.faults import CATALOGUE


def test_the_command_lists_every_fault_on_80_columns_and_those_of_a_channel():
    everything = CliRunner().invoke(faults).output
    assert all(f"  {name}" in everything for name in CATALOGUE)
    assert max(map(len, everything.splitlines())) <= 80
    of_the_ring = json.loads(CliRunner().invoke(faults, ["ring", "motor", "--json"]).output)
    names = {row["name"] for row in of_the_ring}
    assert {"motor_dead", "motor_weak"} <= names
    assert all("ring" in row["channels"] for row in of_the_ring)
    assert "No fault has toe" in CliRunner().invoke(faults, ["toe"]).output
