"""Where log lines go besides the recording: nowhere, or where `-v` and `--log-file` say."""

from __future__ import annotations

import logging
import sys
from contextlib import suppress
from pathlib import Path

import click

from hil.cli.exits import usage_errors
from hil.cli.output import echo, printable

PACKAGES = ("aero", "hil")
"""Whose lines are shown and kept."""
SHOWN = (logging.CRITICAL, logging.INFO, logging.DEBUG)
"""Least level on the terminal, by how often `-v` is given."""
FORMAT = "%(asctime)s %(levelname)s %(name)s: %(message)s"


def log_nowhere() -> None:
    """Keep the log off the terminal: Python prints warnings that no handler takes."""
    for name in PACKAGES:
        logger = logging.getLogger(name)
        if not logger.handlers:
            logger.addHandler(logging.NullHandler())


def with_log(command: click.Command) -> click.Command:
    """Give a command the options `-v` and `--log-file`; a second call does nothing."""
    if all(parameter.name != "log_file" for parameter in command.params):
        command.params += [
            click.Option(
                ["-v", "--verbose"], count=True, expose_value=False, callback=_show, help="Show the log; -vv shows all."
            ),
            click.Option(
                ["--log-file"],
                type=click.Path(dir_okay=False, path_type=Path),
                expose_value=False,
                callback=_keep,
                help="Add the whole log to this file.",
            ),
        ]
    return command


def _show(context: click.Context, _option: click.Parameter, count: int) -> None:
    if count:
        _add(context, logging.StreamHandler(), SHOWN[min(count, len(SHOWN) - 1)])


def _keep(context: click.Context, _option: click.Parameter, path: Path | None) -> None:
    if path is not None:
        with usage_errors():
            _add(context, LogFile(path), logging.DEBUG)


class LogFile(logging.FileHandler):
    """Adds lines to a file; that it cannot be written is said once, and the command continues."""

    def __init__(self, path: Path) -> None:
        super().__init__(path, encoding="utf-8")
        self._path = path
        self._failed = False

    def emit(self, record: logging.LogRecord) -> None:
        """Add a line."""
        if not self._failed:
            super().emit(record)

    def handleError(self, record: logging.LogRecord) -> None:  # noqa: N802 - the name is logging's
        """Say why there are no more lines."""
        self._failed = True
        echo(f"the log in {self._path} ends here, the command continues: {sys.exception()}", err=True)

    def close(self) -> None:
        """Close the file; what cannot be written any more has been said."""
        with suppress(OSError):
            super().close()


class _Printable(logging.Formatter):
    """Shows what a line holds of a board or a file as every other line does."""

    def format(self, record: logging.LogRecord) -> str:
        """Return the line."""
        return printable(super().format(record))


def _add(context: click.Context, handler: logging.Handler, level: int) -> None:
    """Send lines to a handler until the command has ended."""
    handler.setLevel(level)
    handler.setFormatter(_Printable(FORMAT))
    context.call_on_close(handler.close)
    for name in PACKAGES:
        logger = logging.getLogger(name)
        context.call_on_close(lambda logger=logger, before=logger.level: _remove(logger, handler, before))
        logger.setLevel(min(level, logger.getEffectiveLevel()))
        logger.addHandler(handler)


def _remove(logger: logging.Logger, handler: logging.Handler, level: int) -> None:
    logger.removeHandler(handler)
    logger.setLevel(level)
