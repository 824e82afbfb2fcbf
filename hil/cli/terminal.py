"""Text and progress on the terminal: shown as it is, for it holds names of files, headers and errors, and no markup."""

from __future__ import annotations

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
    """Rich's console; whatever is printed, tables and bars too, comes through here before it is coloured."""

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterator[Segment]:
        """Return the parts of what is printed, their text as it can be shown."""
        for part in super().render(renderable, options):
            yield part if part.control else Segment(printable(part.text), part.style)


def console(*, width: int | None = None, stderr: bool = False) -> Console:
    """Return the terminal, on which square brackets, colons and escape sequences are only that."""
    return _Terminal(width=width, stderr=stderr, markup=False, highlight=False, emoji=False)


def _on_stderr() -> Console:
    return console(stderr=True)  # a function, because an argument of this name hides it


LEAST_NAME = 18
"""Characters that a row's name has at least; a longer one continues in the next line."""

Rows = Mapping[str, Sequence[str]]


def print_columns(console: Console, title: str, heads: Sequence[str], rows: Rows) -> None:
    """Print rows under their heads; columns that do not fit beside a row's name go into a table below."""
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
"""Characters of what is being done and of the bar; with percentage and time left they fill 80."""


def description() -> TextColumn:
    """Return the column of a progress bar that says what is being done, cut where it is too long."""
    column = Column(no_wrap=True, overflow="ellipsis", max_width=DOING_WIDTH)
    return TextColumn("{task.description}", markup=False, table_column=column)


LINE_S = 10.0
"""Time between two lines where there is no terminal, s."""


def _moves(console: Console) -> bool:
    """Return whether a bar may move: FORCE_COLOR asks for colours in a log too, and Rich takes it for a terminal."""
    return console.is_terminal and ("FORCE_COLOR" not in os.environ or console.file.isatty())


class ProgressBar(Progress):
    """Rich's bar on standard error, which alone shows nothing where its output is redirected."""

    _said_at = 0.0

    def __init__(
        self, *columns: ProgressColumn, console: Console | None = None, lines: bool = True, **options: Any
    ) -> None:
        """Prepare a bar that leaves nothing behind.

        Args:
            columns: of the bar; the default ones fit into 80 characters.
            console: where it is drawn; standard error when None, because standard output is for results.
            lines: whether a line every `LINE_S` stands for it where there is no terminal.
            options: of Rich.
        """
        self._lines = lines
        chosen = console or _on_stderr()
        # Rich would take what is printed meanwhile to this console, also what goes into a pipe.
        options["redirect_stdout"] = sys.stdout.isatty()
        # Where nobody sees a bar, Rich would leave an empty line.
        options["disable"] = options.get("disable", False) or not _moves(chosen)
        super().__init__(*columns, console=chosen, transient=True, **options)

    @classmethod
    def get_default_columns(cls) -> tuple[ProgressColumn, ...]:
        """Return Rich's, but for a description that is shown as it is: a path may look like markup."""
        return description(), BarColumn(bar_width=BAR_WIDTH), TaskProgressColumn(), TimeRemainingColumn()

    def start(self) -> None:
        """Start the bar, or the time to the first line."""
        self._said_at = self.get_time()
        super().start()

    def update(self, task_id: TaskID, **changes: object) -> None:
        """Note how far a task has got, as `rich.progress.Progress.update` does."""
        super().update(task_id, **changes)  # type: ignore[arg-type]
        self._say(task_id)

    def advance(self, task_id: TaskID, advance: float = 1.0) -> None:
        """Note that a task has got further, as `rich.progress.Progress.advance` does."""
        super().advance(task_id, advance)
        self._say(task_id)

    def _say(self, task_id: TaskID) -> None:
        if not self._lines or _moves(self.console) or self.get_time() < self._said_at + LINE_S:
            return
        self._said_at = self.get_time()
        task = next(task for task in self.tasks if task.id == task_id)
        part = "" if task.total is None else f": {task.percentage:.0f} %"
        self.console.print(f"{task.description}{part}", highlight=False, markup=False)
