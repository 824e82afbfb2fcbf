"""Escape control characters in text of files, boards and other programs, for a terminal."""

import re

_UNSAFE = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u200e\u200f\u202a-\u202e\u2066-\u2069\ud800-\udfff]")
"""Characters that move the cursor, change the terminal or the direction of writing, or cannot be written as UTF-8."""


def printable(text: str) -> str:
    """Return text with control characters escaped: a recording, a unit file or a board may send terminal sequences."""
    return _UNSAFE.sub(lambda found: ascii(found[0])[1:-1], text)


def capital(text: str) -> str:
    """Return text with a capital first letter."""
    return text[:1].upper() + text[1:]
