"""Endings of commands: an exit code per kind and one line of text.

Separate codes keep a failure of the tool from being mistaken for a failure of the hand.
"""

import logging
import os
import signal
import socket
import sys
import threading
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import click
from click.core import ParameterSource

from aero.exit_code import STOPPING, Exit
from aero.printable import printable
from hil.cli.missing import is_ours, other_package
from hil.dialogue.printing import echo, survive_closed_streams
from hil.recordings.errors import (
    FULL_DISK,
    CannotBeMeasuredError,
    CannotBeWrittenError,
    NotOneHandError,
    UnusableFileError,
    UnwritablePlaceError,
)

_LOG = logging.getLogger(__name__)


INTERRUPTED = 130
"""Exit status of a shell after SIGINT."""
TERMINATED = (129, 143)
"""Exit statuses of a shell after SIGHUP and SIGTERM."""


class Ended(click.ClickException):
    """Ending with one line of text and an exit code."""

    def __init__(self, message: str, code: int) -> None:
        super().__init__(printable(message))
        self.exit_code = code  # type: ignore[misc]  # Click reads it of the instance

    def show(self, file: Any = None) -> None:
        """Print the line on standard error."""
        echo(f"Error: {self.message}", err=True)


@contextmanager
def usage_errors() -> Iterator[None]:
    """End with `Exit.USAGE` if options, arguments or user-supplied files are rejected.

    Wrap only the parsing in this context; later errors have their own exit codes. A full disk is never a usage error.
    """
    try:
        yield
    except CannotBeWrittenError:
        raise
    except OSError as error:
        if error.errno in FULL_DISK:
            raise
        context = click.get_current_context(silent=True)
        ours = context is not None and context.get_parameter_source("out") is ParameterSource.DEFAULT
        if isinstance(error, UnwritablePlaceError) and ours:
            raise Ended(f"{error}; start in another folder, or name one with --out", Exit.NOT_WRITTEN) from error
        raise Ended(str(error), Exit.USAGE) from error
    except (ValueError, OverflowError) as error:
        raise Ended(str(error), Exit.USAGE) from error


@contextmanager
def judging(*paths: Path) -> Iterator[None]:
    """Convert errors of user-supplied recordings to one line that names the files.

    Other errors are defects of this program and pass unchanged.
    """
    try:
        yield
    except NotOneHandError as error:
        raise Ended(str(error), Exit.USAGE) from error
    except (CannotBeMeasuredError, UnusableFileError) as error:
        raise Ended(f"{', '.join(map(str, paths))}: {error}", Exit.USAGE) from error


def code_of(error: BaseException) -> Exit:
    """Return the exit code of an exception; builtin exceptions for a lost link and a full disk are mapped too."""
    if isinstance(code := getattr(error, "exit_code", None), int):
        return Exit(code)
    if isinstance(error, ConnectionError):
        return Exit.NO_HAND
    return Exit.NOT_WRITTEN if isinstance(error, OSError) else Exit.DEFECT


def ending(error: BaseException) -> tuple[int, str]:
    """Return the exit code and the message for an exception that reached the command line."""
    if _of_drawing(error):
        named = os.environ.get("MUJOCO_GL", "")
        said = f"MUJOCO_GL={named}: MuJoCo cannot load this OpenGL here ({type(error).__name__}: {error})"
        return Exit.USAGE, f"{said}; unset it, or set it to `egl` where there is no display"
    if isinstance(error, ImportError) and (said := other_package(error)):
        return Exit.USAGE, said
    if isinstance(error, ModuleNotFoundError) and not is_ours(error.name):
        said = f"{error.name} is not installed; an extra brings it, from a checkout: pip install -e '.[hil]'"
        return Exit.USAGE, f"{said}. `aero-hil doctor` lists the extras"
    if isinstance(error, KeyboardInterrupt):
        return INTERRUPTED, str(error) or "interrupted"
    if (code := code_of(error)) is not Exit.DEFECT:
        return code, str(error)
    return Exit.DEFECT, f"a defect of aero-hil, please report it with the lines above: {type(error).__name__}: {error}"


@contextmanager
def ctrl_c_exits() -> Iterator[None]:
    """End the program at once on Ctrl-C while modules are imported, when no cleanup is needed.

    Some libraries swallow `KeyboardInterrupt` while probing for optional modules.
    """
    in_main = threading.current_thread() is threading.main_thread()
    if not in_main or signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        yield
        return

    def leave(_number: int, _frame: object) -> None:
        echo("Error: interrupted", err=True)
        os._exit(INTERRUPTED)

    before = signal.signal(signal.SIGINT, leave)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def _of_drawing(error: BaseException) -> bool:
    """Return whether MuJoCo failed during import while loading the OpenGL named by `MUJOCO_GL`."""
    modules = [frame.f_globals.get("__name__", "") for frame, _ in traceback.walk_tb(error.__traceback__)]
    return any(name.startswith("mujoco.") and name.endswith("gl_context") for name in modules)


@contextmanager
def stopping_announced() -> Iterator[None]:
    """Print "Stopping…" as soon as a stopping signal arrives, regardless of the current work.

    Opening the hand and writing the results may take seconds.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    # A signal handler would wait for the current library call, and some code blocks signals; the wake-up descriptor
    # works in both cases.
    reading, writing = socket.socketpair()
    with reading, writing:
        writing.setblocking(False)
        thread = threading.Thread(target=_announce, args=(reading,), name="stopping", daemon=True)
        thread.start()  # started first, so that a failure leaves no descriptor without a reader
        before = signal.set_wakeup_fd(writing.fileno(), warn_on_full_buffer=False)
        try:
            yield
        finally:
            signal.set_wakeup_fd(before)
            writing.shutdown(socket.SHUT_WR)
            thread.join()


@contextmanager
def not_stopped_in_background() -> Iterator[None]:
    """Ignore the signals by which a terminal stops a job in the background: a stopped program guards no hand."""
    numbers = [getattr(signal, name) for name in ("SIGTTIN", "SIGTTOU") if hasattr(signal, name)]
    if threading.current_thread() is not threading.main_thread():
        numbers = []
    before = {number: signal.signal(number, signal.SIG_IGN) for number in numbers}
    try:
        yield
    finally:
        for number, previous in before.items():
            signal.signal(number, previous)


def _announce(signals: socket.socket) -> None:
    """Print the line once, at the first signal."""
    while received := signals.recv(1):
        if received[0] in STOPPING:
            with suppress(OSError, ValueError):  # the terminal may be closed
                echo("Stopping…", err=True)
            return


def _show_notes(error: BaseException | None) -> None:
    """Print the notes of an exception, such as the frames of a policy's own code."""
    for note in getattr(error, "__notes__", ()):
        echo(note, err=True)


def run_module(command: click.Command) -> None:
    """Run a maintainers' command, `python -m MODULE`, with the exit codes of `aero-hil`."""
    survive_closed_streams()
    run(lambda: command.main(standalone_mode=False))


def run(command: Callable[[], Any]) -> None:
    """Run a command line and end the program with the resulting exit code."""
    try:
        with not_stopped_in_background(), stopping_announced():
            command()
    except click.exceptions.Abort:
        code, line = INTERRUPTED, "interrupted"
    except click.ClickException as error:
        _show_notes(error.__cause__)
        error.show()
        sys.exit(error.exit_code)
    except SystemExit as error:
        if error.code in TERMINATED:
            echo("Error: terminated", err=True)
        raise
    except Exception as error:
        code, line = ending(error)
        if code == Exit.DEFECT:
            traceback.print_exc()
        else:
            _show_notes(error)
    else:
        return
    _LOG.info("ended with %d: %s", code, line)
    echo(f"Error: {line}", err=True)
    sys.exit(code)
