"""Names and headers are shown as they are: Rich would take what stands in square brackets for markup, and fail."""

import dataclasses
import io
import re
from pathlib import Path

import pytest
from click.testing import CliRunner
from damaged_files import write_small_recording
from rich.table import Table
from rich.text import Text

from aero.printable import printable
from hil.cli import main
from hil.dialogue.terminal import console
from hil.recordings.mcap_file import read_recording, write_recording

BELL = "\x1b]0;owned"
SOURCES = Path(__file__).parents[3]


def invoke(*arguments):
    return CliRunner().invoke(main, [str(argument) for argument in arguments])


def test_escape_sequences_of_a_file_reach_no_terminal(tmp_path):
    """A recording once moved the cursor and renamed the window of whoever looked at it."""
    write_small_recording(tmp_path / "a.mcap")
    made = read_recording(tmp_path / "a.mcap")
    evil = "\x1b]0;owned\x07\x1b[2J\u202e\x9b31m"
    header = dataclasses.replace(made.header, target=evil, unit="reference", operator=evil, commit=evil)
    write_recording(dataclasses.replace(made, header=header), tmp_path / "b.mcap")
    result = invoke("report", str(tmp_path / "b.mcap"), "--out", str(tmp_path / "r.html"))
    assert not set(result.output) & set("\x1b\x07\u202e\x9b")
    assert printable(evil) == r"\x1b]0;owned\x07\x1b[2J\u202e\x9b31m"


@pytest.mark.parametrize("shown", [Text(BELL), f"{BELL}", Table(BELL)])
def test_whatever_is_printed_is_printable(shown):
    stream = io.StringIO()
    terminal = console(width=80)
    terminal.file = stream
    terminal.print(shown)
    assert "\x1b" not in stream.getvalue()
    assert "x1b]0" in stream.getvalue()


def test_there_is_one_way_to_print():
    places = [path for folder in ("hil/cli", "train/cli") for path in (SOURCES / folder).rglob("*.py")]
    own = {"output.py", "machine.py"}  # the function itself, and a line of a child process that draws
    found = {path.name for path in places if re.search(r"click\.s?echo\(|(?<![.\w])print\(", path.read_text())}
    assert found - own == {"__init__.py"}, "doctor colours one word of a line"


def test_there_is_one_terminal():
    """Escaping at each place is forgotten at some of them."""
    places = [path for folder in ("hil", "train") for path in (SOURCES / folder).rglob("*.py")]
    texts = {path.name: path.read_text() for path in places if path.name != "terminal.py"}
    assert [
        name
        for name, text in texts.items()
        if re.search(r"\bConsole\(|\bTextColumn\(|from_markup|(?<!html\.)(?<!markupsafe\.)(?<!re\.)\bescape\(", text)
    ] == []
