"""TOML that people bring: what would take a parser minutes, or more stack than there is, is refused in one line."""

from __future__ import annotations

import re
import tomllib
from typing import Any

MOST_PARTS = 64
"""Most parts of a dotted key; `tomllib` needs time with the square of them."""
_PART = r"""(?:"[^"\n]*"|'[^'\n]*'|(?<![\w-])[\w-]+)"""
_DOTTED = re.compile(rf"{_PART}(?:\s*\.\s*{_PART}){{{MOST_PARTS},}}")


def parse_toml(text: str) -> dict[str, Any]:
    """Return the tables of a text.

    Raises:
        ValueError: it is no TOML, its keys have too many parts, or it is nested too deeply.
    """
    if found := _DOTTED.search(text):
        raise ValueError(f"a key has more than {MOST_PARTS} parts: {found[0][:40]}...")
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise ValueError("it is nested too deeply") from None
