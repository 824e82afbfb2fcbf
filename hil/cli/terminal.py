"""Text and progress on the terminal: shown as it is, for it holds names of files, headers and errors, and no markup."""

from __future__ import annotations

from rich.console import Console
from rich.progress import (
    BarColumn,
    Progress,
    ProgressColumn,
    TaskID,
    TaskProgressColumn,
    TextColumn,
    TimeRemainingColumn,
)


def console(*, width: int | None = None, stderr: bool = False) -> Console:
    """Return the terminal, on which square brackets and colons are only that."""
    return Console(width=width, stderr=stderr, markup=False, highlight=False, emoji=False)


def description(width: int = 0) -> TextColumn:
    """Return the column of a progress bar that says what is being done, `width` characters wide or as it needs."""
    return TextColumn(f"{{task.description:{width}}}" if width else "{task.description}", markup=False)


LINE_S = 10.0
"""Time between two lines where there is no terminal, s."""


class ProgressBar(Progress):
    """Rich's bar, which alone shows nothing where its output is redirected."""

    _said_at = 0.0

    @classmethod
    def get_default_columns(cls) -> tuple[ProgressColumn, ...]:
        """Return Rich's, but for a description that is shown as it is: a path may look like markup."""
        return description(), BarColumn(), TaskProgressColumn(), TimeRemainingColumn()

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
        if self.console.is_terminal or self.get_time() < self._said_at + LINE_S:
            return
        self._said_at = self.get_time()
        task = next(task for task in self.tasks if task.id == task_id)
        part = "" if task.total is None else f": {task.percentage:.0f} %"
        left = "" if task.time_remaining is None else f", about {task.time_remaining:.0f} s left"
        self.console.print(f"{task.description}{part}{left}", highlight=False, markup=False)
