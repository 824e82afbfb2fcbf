"""Policy files: one `.npz` with the weights and a JSON header with all settings needed to run them."""

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
"""Size limit of an unpacked policy; the shipped one has 0.5 MB."""
FIXED: dict[str, Any] = {
    "format": FORMAT,
    "version": VERSION,
    "observation": list(OBSERVATION_LAYOUT),
    "action": list(ACTION_LAYOUT),
    "activation": "swish",
    "head": "tanh of the mean",
}
"""Header entries with one supported value; a file with another value is refused."""
FREE = ("name", "shown_action", "settings", "provenance")


@dataclass(frozen=True)
class Policy:
    """Network with the settings of its training."""

    name: str
    network: Acting
    settings: PolicySettings
    """Rate, nominal grasp, scales and noise of the training."""
    shown_action: ShownAction
    """Past action included in the observation."""
    provenance: Mapping[str, Any] = field(default_factory=dict)
    """Origin as JSON values: seed, steps, commit, versions, source file and its digest."""
    declared: Interface | None = None
    """Interface declared by a user-supplied policy; None for a policy of the cube task."""

    @property
    def interface(self) -> Interface:
        """Observation and action: the declared interface, else that of the cube task."""
        return self.declared or cube_interface(self.settings, self.shown_action)


def save(policy: Policy, path: Path) -> None:
    """Write `policy` to `path`; equal policies give equal bytes.

    Raises:
        TypeError: the network is not a `Network`.
    """
    if not isinstance(policy.network, Network):
        raise TypeError(f"{policy.name} is not a network of this project")
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
    """Read a policy and check that its header matches this version of the project.

    Raises:
        FileNotFoundError: missing file.
        PolicyFileError: not a policy file, another version, another layout or order, a missing entry, or weights of a
            wrong shape.
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
    if missing := set(FREE) - set(header):  # further entries describe the training
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
