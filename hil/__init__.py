"""Experiments, metrics, limits and reports over whatever stands right of the driver.

The public names are imported when they are first asked for: the pytest plugin and the command line live below this
package, and neither should load a physics engine to print its help.
"""

from __future__ import annotations

from importlib import import_module
from pkgutil import extend_path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hil.targets.hand_spec import HandSpec
    from hil.targets.opening import open_target
    from hil.targets.target import GroundTruth, MissingCapabilityError, NoHandError, Target

# A project's own folder `hil` that is no package stays importable beside this one.
__path__ = extend_path(__path__, __name__)

_HOMES = {
    "GroundTruth": "hil.targets.target",
    "HandSpec": "hil.targets.hand_spec",
    "MissingCapabilityError": "hil.targets.target",
    "NoHandError": "hil.targets.target",
    "Target": "hil.targets.target",
    "open_target": "hil.targets.opening",
}
"""Public name to the module that defines it."""

__all__ = ["GroundTruth", "HandSpec", "MissingCapabilityError", "NoHandError", "Target", "open_target"]


def __getattr__(name: str) -> object:
    """Import a public name from its home."""
    if name in _HOMES:
        return getattr(import_module(_HOMES[name]), name)
    raise AttributeError(f"module 'hil' has no attribute {name!r}")


def __dir__() -> list[str]:
    """List the public names, imported or not."""
    return sorted({*globals(), *_HOMES})
