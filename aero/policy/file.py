"""Policy files: one `.npz` with the weights and a JSON header that says everything needed to run them rightly."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from aero.policy.interface import Acting, Interface, PolicyFileError, cube_interface
from aero.policy.network import Layer, Network
from aero.policy.settings import PolicySettings
from aero.policy.task import ACTION_LAYOUT, OBSERVATION_LAYOUT, ShownAction
from aero.regular_file import read_npz
from aero.whole_file import whole

FORMAT = "aero-hil policy"
VERSION = 1
LARGEST_BYTES = 64 * 2**20
"""Largest size of a policy, unpacked; the shipped ones have half a million."""
FIXED: dict[str, Any] = {
    "format": FORMAT,
    "version": VERSION,
    "observation": list(OBSERVATION_LAYOUT),
    "action": list(ACTION_LAYOUT),
    "activation": "swish",
    "head": "tanh of the mean",
}
"""Header entries that this version of the project can run in one way only; a file that differs is refused."""
FREE = ("name", "shown_action", "settings", "provenance")


@dataclass(frozen=True)
class Policy:
    """A network and what it was trained with."""

    name: str
    """What a person calls it."""
    network: Acting
    """The function from observation to action."""
    settings: PolicySettings
    """Rate, nominal grasp, scales and noise of its training."""
    shown_action: ShownAction
    """Which action its observation shows."""
    provenance: Mapping[str, Any] = field(default_factory=dict)
    """Where it comes from: JSON values such as seed, steps, commit, versions, source file and its digest."""
    declared: Interface | None = None
    """What it observes and does, of a policy that people bring; None for one of the cube task."""

    @property
    def interface(self) -> Interface:
        """What it observes and does."""
        return self.declared or cube_interface(self.settings, self.shown_action)


def save(policy: Policy, path: Path) -> None:
    """Write `policy` to `path`; the same policy gives the same bytes.

    Raises:
        TypeError: it has no network of this project.
    """
    if not isinstance(policy.network, Network):
        raise TypeError(f"{policy.name} is no network of this project")
    header = FIXED | {
        "name": policy.name,
        "shown_action": policy.shown_action.value,
        "settings": asdict(policy.settings),
        "provenance": dict(policy.provenance),
    }
    arrays: dict[str, Any] = {"mean": policy.network.mean, "std": policy.network.std}
    for i, layer in enumerate(policy.network.layers):
        arrays |= {f"kernel_{i}": layer.kernel, f"bias_{i}": layer.bias}
    with whole(path) as draft, draft.open("xb") as file:
        np.savez(file, header=np.array(json.dumps(header, sort_keys=True, allow_nan=False)), **arrays)


def load(path: Path) -> Policy:
    """Read a policy and check that it means what this project would do with it.

    Raises:
        FileNotFoundError: there is no such file.
        PolicyFileError: not a policy file, another version, another layout or order, a missing entry, or
            weights that do not fit.
    """
    try:
        arrays = read_npz(path, LARGEST_BYTES)
        header = json.loads(str(arrays.pop("header")))
    except (ValueError, KeyError, RecursionError) as error:
        raise PolicyFileError(
            f"{path} is not a policy file ({error}); turn a checkpoint into one with `aero-hil convert-policy`"
        ) from error
    _check_entries(path, header)
    try:
        return _policy(header, arrays)
    except (TypeError, ValueError, LookupError, AttributeError, OverflowError) as error:
        raise PolicyFileError(f"{path}: {error}") from error


def _check_entries(path: Path, header: Any) -> None:
    if not isinstance(header, dict):
        raise PolicyFileError(f"{path}: the header must be a JSON object, got {type(header).__name__}")
    for key, expected in FIXED.items():
        if header.get(key) != expected:
            raise PolicyFileError(f"{path}: {key} must be {expected!r}, the file has {header.get(key)!r}")
    if missing := set(FREE) - set(header):  # what is more says how it was trained
        raise PolicyFileError(f"{path}: entries missing in version {VERSION}: {sorted(missing)}")


def _policy(header: Mapping[str, Any], arrays: dict[str, Any]) -> Policy:
    settings: dict[str, Any] = {
        key: tuple(value) if isinstance(value, list) else value for key, value in header["settings"].items()
    }
    depth = (len(arrays) - 2) // 2
    network = Network(
        mean=arrays.pop("mean"),
        std=arrays.pop("std"),
        layers=tuple(Layer(arrays.pop(f"kernel_{i}"), arrays.pop(f"bias_{i}")) for i in range(depth)),
    )
    if arrays:
        raise ValueError(f"unknown arrays {sorted(arrays)}")
    return Policy(
        name=header["name"],
        network=network,
        settings=PolicySettings(**settings),
        shown_action=ShownAction(header["shown_action"]),
        provenance=header["provenance"],
    )
