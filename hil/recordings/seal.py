"""A digest beside the numbers that it covers, so that a damaged file gives no verdict."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from typing import Any

KEY = "sha256"


def digest(content: Mapping[str, Any]) -> str:
    """Return the SHA-256 of a JSON object, whatever its layout and the order of its keys, in hexadecimal."""
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def sealed(content: Mapping[str, Any]) -> dict[str, Any]:
    """Return a JSON object with its digest."""
    return {**content, KEY: digest(content)}


def unsealed(content: Mapping[str, Any]) -> dict[str, Any]:
    """Return a JSON object without its digest; one that has none, of version 0.1.0, as it is.

    Raises:
        ValueError: it is not what was sealed.
    """
    rest = {key: value for key, value in content.items() if key != KEY}
    if KEY in content and content[KEY] != digest(rest):
        raise ValueError("it is damaged or was edited: its content does not fit its SHA-256")
    return rest
