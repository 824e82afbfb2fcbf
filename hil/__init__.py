"""Experiments, metrics, limits and reports for a hand behind the driver, physical or emulated.

Public names are imported on first use, because pytest plugin and command line belong to this package and should not
load a physics engine to print their help.
"""

from __future__ import annotations

from importlib import import_module
from pkgutil import extend_path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hil.emulated.any_hand import emulate
    from hil.emulated.emulated_target import EmulatedTarget, GroundTruth
    from hil.emulated.faults import CATALOGUE, Injection, parse_fault
    from hil.emulated.pty_process import ServedPort, serve
    from hil.targets.hand_errors import FaultNeverFiredError, MissingCapabilityError, NoHandError
    from hil.targets.opening import open_port
    from hil.targets.target import Target
    from hil.verdict.validation import validate

# The path includes folders named `hil` of user projects, so that their modules stay importable.
__path__ = extend_path(__path__, __name__)

_HOMES = {
    "CATALOGUE": "hil.emulated.faults",
    "EmulatedTarget": "hil.emulated.emulated_target",
    "FaultNeverFiredError": "hil.targets.hand_errors",
    "GroundTruth": "hil.emulated.emulated_target",
    "Injection": "hil.emulated.faults",
    "MissingCapabilityError": "hil.targets.hand_errors",
    "NoHandError": "hil.targets.hand_errors",
    "ServedPort": "hil.emulated.pty_process",
    "Target": "hil.targets.target",
    "emulate": "hil.emulated.any_hand",
    "open_port": "hil.targets.opening",
    "serve": "hil.emulated.pty_process",
    "parse_fault": "hil.emulated.faults",
    "validate": "hil.verdict.validation",
}
_FORMER = {
    "open_target": "hil.emulate(...) or hil.open_port(PATH, ...)",
    "HandSpec": "the arguments of hil.emulate and hil.open_port",
}

__all__ = [
    "CATALOGUE",
    "EmulatedTarget",
    "FaultNeverFiredError",
    "GroundTruth",
    "Injection",
    "MissingCapabilityError",
    "NoHandError",
    "ServedPort",
    "Target",
    "emulate",
    "open_port",
    "parse_fault",
    "serve",
    "validate",
]


def __getattr__(name: str) -> object:
    """Import a public name from its home."""
    if name in _HOMES:
        return getattr(import_module(_HOMES[name]), name)
    if name in _FORMER:
        raise AttributeError(f"hil.{name} is replaced by {_FORMER[name]}")
    raise AttributeError(f"module 'hil' has no attribute {name!r}")


def __dir__() -> list[str]:
    """List the public names, imported or not."""
    return [*__all__]
