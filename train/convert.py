"""Conversion of untrusted Brax PPO checkpoints to policy files.

MuJoCo Playground's released checkpoint is a Python pickle of (normaliser, policy, value). A pickle can call any
function, so only the few classes of such a checkpoint are accepted, each replaced by a passive data class; any other
name is refused before a call. Pickles need no JAX. Brax now writes a folder of arrays, which is read with JAX.
"""

import hashlib
import io
import pickle
import pickletools
import warnings
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from aero.policy.file import Policy
from aero.policy.network import Layer, Network
from aero.policy.settings import PolicySettings
from aero.policy.task import ShownAction
from aero.regular_file import open_regular, read_json

rebuild_numpy = np.empty(0).__reduce__()[0]
"""Constructor in pickled NumPy arrays; its module differs between NumPy versions."""

MAX_BYTES = 64 * 2**20
"""Size limit of a checkpoint file; real ones are about 1.5 MB."""

NETWORK_CONFIG = "ppo_network_config.json"
"""Network description that Brax writes beside the arrays; missing in folders of older Playground versions."""

EXPECTED_OF_NETWORK: dict[str, tuple[Any, ...]] = {
    "activation": ("swish", "silu"),
    "distribution_type": ("tanh_normal",),
    "mean_clip_scale": (None,),
    "policy_obs_key": ("state",),
}
"""Network settings that affect the output, with the values that a policy file supports."""


class CheckpointError(ValueError):
    """File is not a checkpoint of this task, or requests more than data."""


class _Record:
    """Passive substitute for a Brax dataclass: stores fields as attributes and runs no code."""

    def __init__(self, *values: Any) -> None:
        self.values = values

    def __setstate__(self, state: Mapping[str, Any]) -> None:
        self.__dict__.update(state)


def _rebuild_jax(function: Callable[..., Any], arguments: tuple[Any, ...], state: Any, _: Any) -> Any:
    """Rebuild a pickled JAX array as the NumPy array inside."""
    if function is not rebuild_numpy:
        raise CheckpointError(f"a JAX array in the file is rebuilt by {function!r}; only NumPy's rebuilding is allowed")
    array = function(*arguments)
    array.__setstate__(state)
    return array


def _enum_member(substitute: Any, name: str) -> str:
    """Return the name of an enum member; Python 3.11.2 pickles a member as `getattr(class, name)`."""
    if substitute is not int:
        raise CheckpointError(f"the file asks for builtins.getattr of {substitute!r}; do not trust it")
    return name


ALLOWED: dict[tuple[str, str], Any] = {
    ("builtins", "getattr"): _enum_member,
    ("brax.training.acme.running_statistics", "RunningStatisticsState"): _Record,
    ("brax.training.acme.running_statistics", "NormalizationMode"): int,
    ("brax.training.types", "UInt64"): _Record,
    ("jax._src.array", "_reconstruct_array"): _rebuild_jax,
    ("numpy.core.multiarray", "_reconstruct"): rebuild_numpy,
    ("numpy._core.multiarray", "_reconstruct"): rebuild_numpy,
    ("numpy", "ndarray"): np.ndarray,
    ("numpy", "dtype"): np.dtype,
}
"""Names allowed in a checkpoint, with their substitutes."""


class _Unpickler(pickle.Unpickler):
    def find_class(self, module: str, name: str) -> Any:
        if (module, name) not in ALLOWED:
            raise CheckpointError(
                f"the file asks for {module}.{name}, which a policy checkpoint never contains; do not trust it"
            )
        return ALLOWED[module, name]


def network(mean: Any, std: Any, layers: Mapping[str, Mapping[str, Any]]) -> Network:
    """Return the NumPy network of a Brax policy.

    Args:
        mean: mean of the observations, (14,).
        std: standard deviation of the observations, (14,).
        layers: `hidden_0`, `hidden_1`, ... each with `kernel` (in, out) and `bias`.

    Raises:
        ValueError: the arrays do not make a network from 14 observations to 7 actions.
    """

    def single(values: Any) -> Any:
        return np.asarray(values, np.float32)

    ordered = [layers[f"hidden_{i}"] for i in range(len(layers))]
    return Network(
        single(mean), single(std), tuple(Layer(single(layer["kernel"]), single(layer["bias"])) for layer in ordered)
    )


def _content(file: Path) -> bytes:
    with open_regular(file, MAX_BYTES) as stream:
        return stream.read()


def convert(path: Path, settings: PolicySettings, shown_action: ShownAction = ShownAction.BEFORE_LAST) -> Policy:
    """Read a checkpoint; `settings` and `shown_action` supply what its file lacks.

    Args:
        path: pickle of Brax PPO parameters, or the folder that Orbax wrote them into.
        settings: nominal grasp, scales and noise of its training.
        shown_action: which action its observation shows; the released environment shows the one before the last.

    Raises:
        CheckpointError: no such checkpoint, a pickle that asks for anything but its data, or a folder where the
            `train` extra is not installed.
        FileNotFoundError: there is no such file.
    """
    files = _files(path)
    size = sum(file.stat().st_size for file in files)
    if size > MAX_BYTES:
        raise CheckpointError(f"{path} has {size} bytes; a checkpoint of this task has about 1.5 million")
    try:
        content = b"".join(_content(file) for file in files)
        normaliser, actor, *_ = _folder(path) if path.is_dir() else _unpickled(content)
        mean, std = (_state_part(statistics) for statistics in (normaliser.mean, normaliser.std))
        net = network(mean, std, actor["params"])
    except CheckpointError as error:
        raise CheckpointError(f"{path}: {error}") from error
    except Exception as error:  # damaged bytes make the unpickler and the folder reader raise arbitrary exceptions
        said = " ".join(str(error).split()) or type(error).__name__
        raise CheckpointError(
            f"{path} is not a Brax PPO checkpoint of this task (normaliser, policy, value): {said}"
        ) from error
    provenance = {"source": path.name, "sha256": hashlib.sha256(content).hexdigest()}
    return Policy(path.stem, net, settings, shown_action, provenance=provenance)


def _unpickled(content: bytes) -> Any:
    """Return the content of a pickle.

    Python's unpickler allocates as many memo entries as the largest index; one damaged byte could request tens of
    gigabytes.
    """
    for opcode, argument, _ in pickletools.genops(content):
        if opcode.name.endswith("PUT") and argument is not None and argument > len(content):
            raise CheckpointError(f"memo index {argument} exceeds the file's {len(content)} bytes: not a valid pickle")
    return _Unpickler(io.BytesIO(content)).load()


def _files(path: Path) -> list[Path]:
    if not path.is_dir():
        return [path]
    if not (path / "_METADATA").exists():
        steps = sorted((part.name for part in path.iterdir() if part.name.isdigit()), key=int)
        raise CheckpointError(
            f"{path} is a run with checkpoints; give one of them, the last is {path / steps[-1]}"
            if steps
            else f"{path} is not a checkpoint: an Orbax folder has a file _METADATA"
        )
    return sorted(part for part in path.rglob("*") if part.is_file())


def _folder(path: Path) -> tuple[Any, ...]:
    """Return (normaliser, policy, value) of a folder that Orbax wrote for Brax's PPO or MuJoCo Playground.

    Such a folder contains arrays and JSON; no code in it is run.
    """
    try:
        from brax.training.agents.ppo import checkpoint  # noqa: PLC0415 - a pickle is read without JAX
    except ModuleNotFoundError as error:
        raise CheckpointError(
            "folders are read with JAX and Brax; from a checkout: pip install -e '.[train]'"
        ) from error
    if (path / NETWORK_CONFIG).exists():
        _check_network(read_json(path / NETWORK_CONFIG))
    with warnings.catch_warnings():
        # Brax passes no sharding to Orbax, which then uses the folder's and warns about other machines.
        warnings.filterwarnings("ignore", "Sharding info not provided")
        return tuple(checkpoint.load(path.absolute()))


def _check_network(config: dict[str, Any]) -> None:
    if not config.get("normalize_observations", True):
        raise ValueError("its network does not normalise observations")
    settings = config.get("network_factory_kwargs", {})
    for name, allowed in EXPECTED_OF_NETWORK.items():
        if settings.get(name, allowed[0]) not in allowed:
            raise ValueError(f"its network has {name} {settings[name]!r}; a policy file holds {allowed[0]!r} alone")


def _state_part(statistics: Any) -> Any:
    """Return the actor's part of the normaliser's statistics, which may include a part for the critic."""
    return statistics["state"] if isinstance(statistics, Mapping) else statistics
