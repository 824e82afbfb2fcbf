"""Progress on standard error: a bar within 80 characters, lines where nobody sees one."""

import io
import re

import pytest
from click.testing import CliRunner
from rich.console import Console

from hil.checks import EXPERIMENTS
from hil.cli import main
from hil.cli.validation_run import RunProgress
from hil.dialogue.terminal import LINE_S, ProgressBar
from hil.view.feed import Observer


def watched(*, terminal, lines=True):
    """Return what half a minute of work prints."""
    now, page = [100.0], io.StringIO()
    console = Console(file=page, force_terminal=terminal, width=80)
    with ProgressBar(console=console, get_time=lambda: now[0], auto_refresh=False, lines=lines) as bar:
        task = bar.add_task("calibrating [/z]", total=30)
        for second in range(30):
            now[0] += 1.0
            bar.update(task, completed=second + 1) if second % 2 else bar.advance(task)
            bar.refresh()
    return page.getvalue()


def test_a_redirected_command_says_a_line_every_ten_seconds():
    lines = watched(terminal=False).splitlines()
    assert LINE_S == 10.0
    assert lines == [f"calibrating [/z]: {percent} %" for percent in (33, 67, 100)]


def test_a_command_with_lines_of_its_own_says_no_others():
    assert watched(terminal=False, lines=False) == ""


def test_a_terminal_gets_no_lines():
    assert "calibrating [/z]: " not in watched(terminal=True)


def test_colours_in_a_log_are_no_moving_bar(monkeypatch):
    """It made 92 kB of a log of 2.7 kB."""
    monkeypatch.setenv("FORCE_COLOR", "1")
    assert watched(terminal=None) == watched(terminal=False)


def test_a_validation_is_one_bar_over_the_whole_run_in_80_columns():
    page, chosen = io.StringIO(), [EXPERIMENTS[name] for name in ("presence", "staircase", "excursion")]
    console = Console(file=page, force_terminal=True, width=80)
    with ProgressBar(console=console, auto_refresh=False, lines=False) as bar:
        along, parts = RunProgress(bar, chosen, Observer()), []
        for done in (0.0, 0.5, 1.0):
            along.step(done, "something that takes long to say, and more")
            bar.refresh()
            parts.append(bar.tasks[0].completed)
    whole_s = sum(experiment.hand_s for experiment in chosen)
    assert parts == pytest.approx([0.0, 0.5 * chosen[0].hand_s / whole_s, chosen[0].hand_s / whole_s])
    shown = [re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", line) for line in page.getvalue().replace("\r", "\n").splitlines()]
    assert max(map(len, shown)) <= 80
    assert "1 of 3, presence: " in "".join(shown)


def test_validate_prints_an_experiment_a_line_to_standard_error(tmp_path):
    arguments = ["validate", "--only", "presence", "--only", "response", "--out", str(tmp_path / "run")]
    result = CliRunner().invoke(main, arguments)
    assert result.exit_code == 0
    lines = result.stderr.splitlines()
    assert [line.split()[0] for line in lines[:2]] == ["presence", "response"]
    assert not any("%" in line for line in lines[:2])
