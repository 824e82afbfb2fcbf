"""The first hour, word for word: every command in order, and the output that the page shows.

What takes more than a few seconds is marked slow; `tox -e realtime` runs it.
"""

from contextlib import ExitStack

import pytest
from pages import blocks, missing, steps
from terminal import INSTALLATION, Terminal

PAGE = "docs/tutorial.md"
QUICK = ("aero-hil validate --only presence --only audit", "aero-hil replay", "aero-hil view")
STEPS = [(command, shown) for command, shown in steps(PAGE) if not INSTALLATION.match(command)]


def follow(chosen, folder):
    """Type commands one after the other."""
    script = folder / "wave.py"
    script.write_text(blocks(PAGE, "python")[0].replace("/tmp/hand", str(folder / "hand")), encoding="utf-8")
    with ExitStack() as stack:
        terminal = Terminal(folder, stack)
        for command, shown in chosen:
            expected = [line.replace("/tmp/", f"{folder}/") for line in shown]
            terminal.type(command, expected, codes={int("--fault" in command)})


def test_nearly_every_command_shows_its_output():
    assert len(STEPS) > 12
    assert sum(not shown for _, shown in STEPS) <= 2


def test_what_is_recorded_replays_alike(tmp_path):
    chosen = [step for step in STEPS if step[0].startswith(QUICK)]
    assert len(chosen) == 4
    follow(chosen, tmp_path)


@pytest.mark.slow
def test_the_first_hour(tmp_path):
    follow(STEPS, tmp_path)


def test_output_that_is_not_printed_is_noticed():
    printed = "within limits; 192 s of hand\ntime in 17.4 s;"
    assert not missing(["within limits; 192 s of hand time in … s;"], printed)
    assert missing(["within limits; 193 s of hand time in … s;"], printed) != []
