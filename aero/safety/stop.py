"""The one exception of a guarded hand."""

from __future__ import annotations


class SafetyStopError(Exception):
    """A hand was stopped, or not moved at all, because going on was not safe.

    Not an `AeroError`: a program that puts up with a lost reading must not put up with this.
    """
