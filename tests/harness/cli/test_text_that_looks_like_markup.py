"""Names and headers are shown as they are: Rich would take what stands in square brackets for markup, and fail."""

import dataclasses
import re
from pathlib import Path

from click.testing import CliRunner
from damaged_files import write_small_recording

from hil.cli import main
from hil.recordings.mcap_file import read_recording, write_recording

ODD = "q[/z]:x:"
SOURCES = Path(__file__).parents[3]


def invoke(*arguments):
    return CliRunner().invoke(main, [str(argument) for argument in arguments])


def test_headers_are_shown_as_they_are(tmp_path):
    write_small_recording(tmp_path / "a.mcap")
    made = read_recording(tmp_path / "a.mcap")
    write_recording(
        dataclasses.replace(made, header=dataclasses.replace(made.header, target=ODD, unit=ODD)), tmp_path / "b.mcap"
    )
    result = invoke("report", tmp_path / "a.mcap", "--beside", tmp_path / "b.mcap", "--out", tmp_path / "r.html")
    assert "Traceback" not in result.output
    assert result.exit_code in {0, 2}, result.output


def test_there_is_one_terminal():
    """Escaping at each place is forgotten at some of them."""
    places = [path for folder in ("hil", "train") for path in (SOURCES / folder).rglob("*.py")]
    texts = {path.name: path.read_text() for path in places if path.name != "terminal.py"}
    assert [
        name
        for name, text in texts.items()
        if re.search(r"\bConsole\(|\bTextColumn\(|from_markup|(?<!html\.)(?<!markupsafe\.)\bescape\(", text)
    ] == []
