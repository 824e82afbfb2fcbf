"""Text as a terminal may show it: control characters of files, boards and other programs become escapes."""

from __future__ import annotations

import re

_UNSAFE = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u200e\u200f\u202a-\u202e\u2066-\u2069\ud800-\udfff]")
"""Characters that move the cursor, change the terminal or the direction of writing, or cannot be written as UTF-8."""


def printable(text: str) -> str:
    """Return text as it can be shown: a recording, a unit or a board may hold escape sequences of a terminal."""
    return _UNSAFE.sub(lambda found: ascii(found[0])[1:-1], text)
