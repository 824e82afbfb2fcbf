"""Text on its way to the terminal: shown as it is, for it holds names of files, headers and errors, and no markup."""

from __future__ import annotations

from rich.console import Console
from rich.progress import TextColumn


def console(*, width: int | None = None, stderr: bool = False) -> Console:
    """Return the terminal, on which square brackets and colons are only that."""
    return Console(width=width, stderr=stderr, markup=False, highlight=False, emoji=False)


def description(width: int = 0) -> TextColumn:
    """Return the column of a progress bar that says what is being done, `width` characters wide or as it needs."""
    return TextColumn(f"{{task.description:{width}}}" if width else "{task.description}", markup=False)
