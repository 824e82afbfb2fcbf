"""Errors of a target; each has the exit code of a command that it ends."""

from collections.abc import Iterable

from aero.exit_code import Exit


class NoHandError(Exception):
    """No hand answers at the target; the message names the target and a remedy."""

    exit_code = Exit.NO_HAND


class MissingCapabilityError(Exception):
    """The target lacks a capability; the message names a target that has it."""

    exit_code = Exit.USAGE


class FaultNeverFiredError(Exception):
    """A requested fault had no effect: the run ended before its start time, or no bytes reached it."""

    exit_code = Exit.USAGE

    def __init__(self, faults: Iterable[object]) -> None:
        super().__init__(
            f"never fired: {', '.join(map(str, faults))}; let the run go on past the time at which it begins, "
            "and send or read what it acts on"
        )


class LookEndedError(KeyboardInterrupt):
    """The person ended the visual inspection after the hand was opened."""
