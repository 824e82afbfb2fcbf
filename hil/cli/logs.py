"""Where log lines go besides the recording: nowhere, or to the terminal with `-v`."""

from __future__ import annotations

import logging

import click

from aero.printable import printable

PACKAGES = ("aero", "hil")
"""Whose lines are shown."""
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
    """Give a command the option `-v`; a second call does nothing."""
    if all(parameter.name != "verbose" for parameter in command.params):
        says = "Show the log on standard error; -vv shows all."
        option = click.Option(["-v", "--verbose"], count=True, expose_value=False, callback=_show, help=says)
        command.params.append(option)
    return command


class _Printable(logging.Formatter):
    """Shows what a line holds of a board or a file as every other line does."""

    def format(self, record: logging.LogRecord) -> str:
        """Return the line."""
        return printable(super().format(record))


def _show(context: click.Context, _option: click.Parameter, count: int) -> None:
    """Send lines to the terminal until the command has ended."""
    if not count:
        return
    handler, level = logging.StreamHandler(), SHOWN[min(count, len(SHOWN) - 1)]
    handler.setLevel(level)
    handler.setFormatter(_Printable(FORMAT))
    for name in PACKAGES:
        logger = logging.getLogger(name)
        context.call_on_close(lambda logger=logger, before=logger.level: _remove(logger, handler, before))
        logger.setLevel(min(level, logger.getEffectiveLevel()))
        logger.addHandler(handler)


def _remove(logger: logging.Logger, handler: logging.Handler, level: int) -> None:
    logger.removeHandler(handler)
    logger.setLevel(level)
