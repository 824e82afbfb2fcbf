"""Ctrl-C at any line of `validate`, once or twice, keeps what was measured, and is no defect."""

import signal
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner
from nightly import NIGHTLY

import hil
from hil.cli import main
from hil.recordings.mcap_file import read_recording

HIL = str(Path(hil.__file__).parent)
MOMENTS = 60 if NIGHTLY else 3


class Stopping:
    """Sends Ctrl-C at the lines of `hil` with these numbers."""

    def __init__(self, *numbers):
        self._numbers, self.lines = set(numbers), 0

    def __enter__(self):
        sys.settrace(self._trace)
        return self

    def __exit__(self, *_):
        sys.settrace(None)

    def _trace(self, frame, event, _argument):
        if not frame.f_code.co_filename.startswith(HIL):
            return None
        if event == "line":
            self.lines += 1
            if self.lines in self._numbers:
                signal.raise_signal(signal.SIGINT)
        return self._trace


def validated(folder, *numbers):
    with Stopping(*numbers) as stopping:
        ended = CliRunner().invoke(main, ["validate", "--only", "presence", "--out", str(folder)])
    return ended, stopping.lines


@pytest.fixture(scope="module")
def lines(tmp_path_factory):
    """Number of lines in a run, after a first one that fills the caches."""
    validated(tmp_path_factory.mktemp("first"))
    ended, lines = validated(tmp_path_factory.mktemp("whole"))
    assert ended.exit_code == 0, ended.output
    return lines


@pytest.mark.parametrize("moment", range(MOMENTS))
def test_what_was_measured_is_kept(moment, lines, tmp_path):
    """One in six clicks on *Stop* ended with 70; seven in ten double Ctrl-C left no report."""
    first = round((moment + 0.5) / MOMENTS * lines)
    ended, _ = validated(tmp_path, first, *([] if moment % 2 else [first + 40 * moment]))
    assert ended.exit_code == 130, ended.output
    for file in tmp_path.glob("*.mcap"):
        read_recording(file)
    assert (tmp_path / "report.html").exists() == bool(list(tmp_path.glob("*.mcap")))
