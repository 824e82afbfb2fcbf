"""The exceptions of a guarded hand."""

from __future__ import annotations


class SafetyStopError(Exception):
    """A hand was stopped, or not moved at all, because going on was not safe.

    Not an `AeroError`: a program that puts up with a lost reading must not put up with this.
    """


class LinkLostError(SafetyStopError, ConnectionError):
    """The link was lost while a hand may have been closed, so that it could not be opened; nothing else was wrong."""
