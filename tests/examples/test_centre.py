"""The example `centre` leads through the maker's procedure, on an emulated hand."""

import re

import pytest
from centre import centre
from click.testing import CliRunner


def run(*arguments, typed=""):
    return CliRunner().invoke(centre, arguments, input=typed)


@pytest.mark.parametrize(("side", "open_end"), [("right", 3278 + 56), ("left", 817 - 56)])
def test_it_centres_where_the_person_says_and_trims_the_open_end(side, open_end):
    done = run("ring", "--firmware", "main", "--side", side, typed="50\n45\ndone\n\nx\n5\ndone\n")
    assert done.exit_code == 0, done.output
    assert "it stands at 45%" in done.output or "it stands at 44%" in done.output, done.output
    reads = int(re.search(r"reads (\d+) counts here, near the middle", done.output).group(1))
    assert reads == pytest.approx(2048, abs=40)
    assert "'x' is no number" in done.output
    assert f"the open end is at {open_end} of 0..4095 counts" in done.output
    assert done.output.endswith("ring: done\n")


def test_an_older_board_is_told_at_once():
    told = run("ring", "--firmware", "0.2.0")
    assert told.exit_code == 2, told.output
    assert "does not know CALIBRATE_MID" in told.output


def test_input_that_ends_leaves_the_hand_to_its_guard():
    ended = run("ring", "--firmware", "main", typed="50\n")
    assert ended.exit_code == 1, ended.output
