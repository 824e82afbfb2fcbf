"""The first hour, word for word: every command in order, and the output that the page shows.

`tox -e realtime` runs it.
"""

from contextlib import ExitStack

import pytest
from pages import INSTALLATION, blocks, missing, steps, typed
from terminal import Terminal

PAGE = "docs/tutorial.md"
STEPS = [(command, shown) for command, shown in steps(PAGE) if not INSTALLATION.match(command)]


def test_nearly_every_command_shows_its_output():
    assert len(STEPS) > 12
    assert sum(not shown for _, shown in STEPS) <= 2


@pytest.mark.slow
def test_the_first_hour(tmp_path, installed):
    script = tmp_path / "wave.py"
    script.write_text(blocks(PAGE, "python")[0].replace("/tmp/hand", str(tmp_path / "hand")), encoding="utf-8")
    with ExitStack() as stack:
        (installation,) = {one.installation for one in typed(PAGE)}
        terminal = Terminal(tmp_path, stack, installed(installation))
        for command, shown in STEPS:
            expected = [line.replace("/tmp/", f"{tmp_path}/") for line in shown]
            terminal.type(command, expected, codes={int("--fault" in command or "diagnose" in command)})


def test_output_that_is_not_printed_is_noticed():
    printed = "within limits; 192 s of hand\ntime in 17.4 s;"
    assert not missing(["within limits; 192 s of hand time in … s;"], printed)
    assert missing(["within limits; 193 s of hand time in … s;"], printed) != []
