"""Output of log lines besides the recording: none, or the terminal with `-v`."""

import logging

import click

from aero.printable import printable

PACKAGES = ("aero", "hil")
"""Packages whose log lines are shown."""
SHOWN = (logging.CRITICAL, logging.INFO, logging.DEBUG)
"""Lowest level shown on the terminal, by the number of `-v`."""
FORMAT = "%(asctime)s %(levelname)s %(name)s: %(message)s"


def log_nowhere() -> None:
    """Add null handlers, because Python prints warnings of loggers without handlers."""
    for name in PACKAGES:
        logger = logging.getLogger(name)
        if not logger.handlers:
            logger.addHandler(logging.NullHandler())


def with_log(command: click.Command) -> click.Command:
    """Add the option `-v` to a command; repeated calls have no effect."""
    if all(parameter.name != "verbose" for parameter in command.params):
        says = "Show the log on standard error; -vv shows all."
        option = click.Option(["-v", "--verbose"], count=True, expose_value=False, callback=_show, help=says)
        command.params.append(option)
    return command


class _Printable(logging.Formatter):
    """Formatter that escapes control characters from boards and files."""

    def format(self, record: logging.LogRecord) -> str:
        """Return the formatted line."""
        return printable(super().format(record))


def _show(context: click.Context, _option: click.Parameter, count: int) -> None:
    """Send log lines to the terminal until the command ends."""
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
