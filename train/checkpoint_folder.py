"""Read the folder that Orbax writes a checkpoint into for Brax's PPO and MuJoCo Playground today.

Such a folder holds arrays and JSON; nothing in it is run. Needs the `train` extra.
"""

from __future__ import annotations

import json
import warnings
from pathlib import Path
from typing import Any

from brax.training.agents.ppo import checkpoint

CONFIG = "ppo_network_config.json"
"""What Brax writes beside the arrays; folders of older versions of Playground are without it."""

EXPECTED: dict[str, tuple[Any, ...]] = {
    "activation": ("swish", "silu"),
    "distribution_type": ("tanh_normal",),
    "mean_clip_scale": (None,),
    "policy_obs_key": ("state",),
}
"""Settings of the network that decide what it does with an observation, and the values a policy file can hold."""


def read(folder: Path) -> tuple[Any, ...]:
    """Return (normaliser, policy, value) of the checkpoint in `folder`.

    Raises:
        ValueError: its network is built otherwise than the task's.
    """
    config = folder / CONFIG
    if config.exists():
        _check(json.loads(config.read_text()))
    with warnings.catch_warnings():
        # Brax does not say where the arrays shall go; Orbax then asks the folder, and warns that other machines differ.
        warnings.filterwarnings("ignore", "Sharding info not provided")
        parameters: tuple[Any, ...] = tuple(checkpoint.load(folder.absolute()))
    return parameters


def _check(config: dict[str, Any]) -> None:
    if not config.get("normalize_observations", True):
        raise ValueError("its network does not normalise observations")
    settings = config.get("network_factory_kwargs", {})
    for name, allowed in EXPECTED.items():
        if settings.get(name, allowed[0]) not in allowed:
            raise ValueError(f"its network has {name} {settings[name]!r}; a policy file holds {allowed[0]!r} alone")
