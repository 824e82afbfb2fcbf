"""Progress where nobody sees a bar."""

import io

from rich.console import Console

from hil.cli.terminal import LINE_S, ProgressBar, time_left


def watched(*, terminal):
    """Return what half a minute of work prints."""
    now, page = [100.0], io.StringIO()
    with ProgressBar(
        console=Console(file=page, force_terminal=terminal, width=80), get_time=lambda: now[0], auto_refresh=False
    ) as bar:
        task = bar.add_task("calibrating [/z]", total=30)
        for second in range(30):
            now[0] += 1.0
            bar.update(task, completed=second + 1) if second % 2 else bar.advance(task)
    return page.getvalue()


def test_a_redirected_command_says_a_line_every_ten_seconds():
    lines = [line for line in watched(terminal=False).splitlines() if "%" in line and ": " in line]
    assert LINE_S == 10.0
    assert [line.split(",")[0] for line in lines] == [f"calibrating [/z]: {percent} %" for percent in (33, 67, 100)]
    assert "20 s left" in lines[0]


def test_a_terminal_gets_no_lines():
    assert "calibrating [/z]: " not in watched(terminal=True)


def test_no_time_is_promised_before_enough_is_done():
    now = [100.0]
    with ProgressBar(console=Console(file=io.StringIO()), get_time=lambda: now[0], auto_refresh=False) as bar:
        bar.add_task("evaluating", total=100)
        (task,), said = bar.tasks, []
        for done, at_s in ((0, 0.0), (1, 0.5), (4, 3.0), (10, 6.0), (50, 30.0), (100, 60.0)):
            now[0] = 100.0 + at_s
            bar.update(task.id, completed=done)
            said.append(time_left(task))
    assert said == ["", "", "", "about 54 s left", "about 30 s left", "about 0 s left"]
