"""Errors between a program and a hand, classified by cause; every message ends with a remedy.

A lost link (unplugged, closed by the other side) raises `ConnectionError`, an invalid argument `ValueError`; the errors
below have their cause beyond the port.
"""

from aero.exit_code import Exit


class AeroError(Exception):
    """Base class of all errors below."""

    exit_code = Exit.NO_HAND


class LinkTimeoutError(AeroError, TimeoutError):
    """The board did not reply within the time-out."""


class DesyncError(AeroError):
    """Incomplete or invalid frame sent or received: board and host disagree on where frames start."""


class RefusedError(AeroError):
    """The board understood the request and refused it."""


class NoTelemetryError(AeroError):
    """The board answers, but since its start no telemetry cycle has read all seven servos."""


class EchoError(AeroError):
    """The line only echoes the sent bytes; no hand answers."""
