"""Text and progress on the terminal, printed without markup, because it contains file names, headers and errors."""

import os
import sys
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from rich.console import Console, ConsoleOptions, RenderableType
from rich.progress import (
    BarColumn,
    Progress,
    ProgressColumn,
    TaskID,
    TaskProgressColumn,
    TextColumn,
    TimeRemainingColumn,
)
from rich.segment import Segment
from rich.table import Column, Table

from aero.printable import printable


class _Terminal(Console):
    """Rich console that escapes the text of everything printed, including tables and bars."""

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterator[Segment]:
        """Yield the segments with printable text."""
        for part in super().render(renderable, options):
            yield part if part.control else Segment(printable(part.text), part.style)


def console(*, width: int | None = None, stderr: bool = False) -> Console:
    """Return a console without markup: square brackets, colons and escape sequences are plain text."""
    return _Terminal(width=width, stderr=stderr, markup=False, highlight=False, emoji=False)


def _on_stderr() -> Console:
    return console(stderr=True)  # a function, because an argument of this name hides it


LEAST_NAME = 18
"""Smallest width of a row's name, characters; longer names are wrapped."""

Rows = Mapping[str, Sequence[str]]


def print_columns(console: Console, title: str, heads: Sequence[str], rows: Rows) -> None:
    """Print rows under their headings; columns beyond the width continue in another table below."""
    widths = [max(map(len, (head, *(row[k] for row in rows.values())))) for k, head in enumerate(heads)]
    name_width = max(LEAST_NAME, min(max(map(len, rows), default=0), console.width - 4 - max(widths, default=0) - 3))
    first = 0
    while first < len(heads):
        last, used = first + 1, name_width + 4 + widths[first] + 3
        while last < len(heads) and used + widths[last] + 3 <= console.width:
            used, last = used + widths[last] + 3, last + 1
        table = Table(title=title if first == 0 else None, title_justify="left")
        table.add_column("", overflow="fold", width=min(name_width, max(map(len, rows), default=1)))
        for head, width in zip(heads[first:last], widths[first:last], strict=True):
            table.add_column(head, justify="right", no_wrap=True, min_width=width)
        for name, row in rows.items():
            table.add_row(name, *row[first:last])
        console.print(table)
        first = last


DOING_WIDTH, BAR_WIDTH = 38, 16
"""Widths of description and bar, characters; with percentage and remaining time they fill 80."""


def plain(template: str) -> TextColumn:
    """Return a text column of a progress bar without markup."""
    return TextColumn(template, markup=False)


def description() -> TextColumn:
    """Return the description column of a progress bar, truncated with an ellipsis."""
    column = Column(no_wrap=True, overflow="ellipsis", max_width=DOING_WIDTH)
    return TextColumn("{task.description}", markup=False, table_column=column)


LINE_S = 10.0
"""Period of progress lines without a terminal, s."""


def _moves(console: Console) -> bool:
    """Return whether a bar can be animated; Rich takes FORCE_COLOR for a terminal, also in a log file."""
    return console.is_terminal and ("FORCE_COLOR" not in os.environ or console.file.isatty())


class ProgressBar(Progress):
    """Rich progress bar on standard error, with plain lines if the output is redirected."""

    _said_at = 0.0

    def __init__(
        self, *columns: ProgressColumn, console: Console | None = None, lines: bool = True, **options: Any
    ) -> None:
        """Create a bar that is erased at the end.

        Args:
            columns: columns of the bar; the default ones fit into 80 characters.
            console: console of the bar; None for standard error, because standard output is for results.
            lines: True to print a line every `LINE_S` if the console is not a terminal.
            options: options of Rich.
        """
        self._lines = lines
        chosen = console or _on_stderr()
        # Rich would redirect standard output to this console even if it is a pipe.
        options["redirect_stdout"] = sys.stdout.isatty()
        # without a terminal, Rich would print an empty line
        options["disable"] = options.get("disable", False) or not _moves(chosen)
        super().__init__(*columns, console=chosen, transient=True, **options)

    @classmethod
    def get_default_columns(cls) -> tuple[ProgressColumn, ...]:
        """Return Rich's columns with a description without markup, because a path may look like markup."""
        return description(), BarColumn(bar_width=BAR_WIDTH), TaskProgressColumn(), TimeRemainingColumn()

    def start(self) -> None:
        """Start the bar and the time to the first line."""
        self._said_at = self.get_time()
        super().start()

    def update(self, task_id: TaskID, **changes: object) -> None:
        """Update a task's progress, like `rich.progress.Progress.update`."""
        super().update(task_id, **changes)  # type: ignore[arg-type]
        self._say(task_id)

    def advance(self, task_id: TaskID, advance: float = 1.0) -> None:
        """Advance a task, like `rich.progress.Progress.advance`."""
        super().advance(task_id, advance)
        self._say(task_id)

    def _say(self, task_id: TaskID) -> None:
        if not self._lines or _moves(self.console) or self.get_time() < self._said_at + LINE_S:
            return
        self._said_at = self.get_time()
        task = next(task for task in self.tasks if task.id == task_id)
        part = "" if task.total is None else f": {task.percentage:.0f} %"
        self.console.print(f"{task.description}{part}", highlight=False, markup=False)
