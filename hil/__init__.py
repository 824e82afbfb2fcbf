"""Experiments, metrics, limits and reports for a hand behind the driver, physical or emulated.

Public names are imported on first use, because pytest plugin and command line belong to this package and should not
load a physics engine to print their help.
"""

from __future__ import annotations

from importlib import import_module
from pkgutil import extend_path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hil.targets.hand_errors import MissingCapabilityError, NoHandError
    from hil.targets.hand_spec import HandSpec
    from hil.targets.opening import open_target
    from hil.targets.target import GroundTruth, Target

# The path includes folders named `hil` of user projects, so that their modules stay importable.
__path__ = extend_path(__path__, __name__)

_HOMES = {
    "GroundTruth": "hil.targets.target",
    "HandSpec": "hil.targets.hand_spec",
    "MissingCapabilityError": "hil.targets.hand_errors",
    "NoHandError": "hil.targets.hand_errors",
    "Target": "hil.targets.target",
    "open_target": "hil.targets.opening",
}

__all__ = ["GroundTruth", "HandSpec", "MissingCapabilityError", "NoHandError", "Target", "open_target"]


def __getattr__(name: str) -> object:
    """Import a public name from its home."""
    if name in _HOMES:
        return getattr(import_module(_HOMES[name]), name)
    raise AttributeError(f"module 'hil' has no attribute {name!r}")


def __dir__() -> list[str]:
    """List the public names, imported or not."""
    return sorted({*globals(), *_HOMES})
