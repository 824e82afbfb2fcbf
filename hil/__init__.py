"""Experiments, metrics, limits and reports over whatever stands right of the driver.

`open_target` and what belongs to it are imported when they are first asked for: the pytest plugin and the command line
live below this package, and neither should load a physics engine to print its help.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hil.target import MissingCapabilityError, NoHandError, Target, open_target

__all__ = ["MissingCapabilityError", "NoHandError", "Target", "open_target"]


def __getattr__(name: str) -> object:
    """Import one of the public names from `hil.target`."""
    if name in __all__:
        return getattr(import_module("hil.target"), name)
    raise AttributeError(f"module 'hil' has no attribute {name!r}")
