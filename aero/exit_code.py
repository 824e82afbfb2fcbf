"""Exit codes, which exceptions of this project carry as `exit_code`, and signals that stop a program."""

import signal
from enum import IntEnum


class Exit(IntEnum):
    """Exit code of the command line, as tabulated in docs/commands.md."""

    WITHIN_LIMITS = 0
    """Completed; all judged values within limits."""
    OUT_OF_LIMITS = 1
    """Completed; at least one judged value out of limits."""
    USAGE = 2
    """Invalid option, argument or input file."""
    NO_HAND = 3
    """No hand answers, or the link was lost."""
    STOPPED = 4
    """The guard stopped the hand, or refused to move it."""
    NOT_WRITTEN = 5
    """A result could not be written."""
    FIRMWARE = 6
    """A firmware program ended, hung, or was stopped by a sanitizer."""
    HOST_BUSY = 7
    """Scheduling delays of this computer were too frequent for a verdict."""
    DEFECT = 70


STOPPING = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))
"""Signals that stop a program; Windows lacks SIGHUP, a closed terminal."""
