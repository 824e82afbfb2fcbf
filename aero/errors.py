"""What can go wrong between a program and a hand, named after who is to blame; every message ends with a remedy.

A link that is gone (unplugged, closed by the other side) is Python's own `ConnectionError`, an argument that must not
be sent is a `ValueError`; what is here is wrong beyond the port.
"""

from __future__ import annotations

from aero.exit_code import Exit


class AeroError(Exception):
    """Base of the errors below, for programs that treat them alike."""

    exit_code = Exit.NO_HAND


class LinkTimeoutError(AeroError, TimeoutError):
    """The board said nothing within the time it was given."""


class DesyncError(AeroError):
    """Bytes came or went that are no frame; board and host disagree where frames start."""


class RefusedError(AeroError):
    """The board understood the request and turned it down."""


class NoTelemetryError(AeroError):
    """The board answers, but not one of its telemetry cycles has reached all seven servos since it started."""


class EchoError(AeroError):
    """The line echoes what is sent, and nothing else answers."""
