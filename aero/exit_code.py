"""Exit codes: an exception of ours carries the one that its kind of ending has, as `exit_code`."""

from __future__ import annotations

from enum import IntEnum


class Exit(IntEnum):
    """Exit codes; docs/commands.md has the same table."""

    WITHIN_LIMITS = 0
    """Done; what was judged is within limits."""
    OUT_OF_LIMITS = 1
    """Done; something that was judged is out of limits."""
    USAGE = 2
    """An option, an argument or a file that was given cannot be used."""
    NO_HAND = 3
    """No hand answers, or the link was lost."""
    STOPPED = 4
    """The guard stopped the hand, or did not let it move."""
    NOT_WRITTEN = 5
    """A result could not be written."""
    FIRMWARE = 6
    """A firmware program ended, hangs, or was stopped by a sanitizer."""
    HOST_BUSY = 7
    """This computer was held up too often for a verdict."""
    DEFECT = 70
    """A mistake of this program."""
