"""Shipped policies by name."""

from importlib.resources import as_file, files
from pathlib import Path

from aero.policy.file import Policy, load
from aero.policy.interface import PolicyFileError
from aero.policy.own import is_own, load_own

DEFAULT = "steady"
"""Policy trained by `aero-hil train steady`, for any cube on a hand with a cable-length correction."""
_SUFFIX = ".npz"


def shipped_policies() -> tuple[str, ...]:
    """Return the names of the shipped policies."""
    return tuple(sorted(Path(entry.name).stem for entry in files(__name__).iterdir() if entry.name.endswith(_SUFFIX)))


def find_policy(name: str) -> Policy:
    """Return a policy by shipped name, path, or Python factory.

    Args:
        name: `steady`, a policy file, `FILE.onnx` or `package.module:factory`.

    Raises:
        PolicyFileError: unknown name, or a policy that cannot be run.
    """
    if name in shipped_policies():
        with as_file(files(__name__) / f"{name}{_SUFFIX}") as path:
            return load(path)
    if is_own(name):
        return load_own(name)
    path = Path(name)
    if not path.is_file():
        raise PolicyFileError(
            f"unknown policy {name!r}; choose from {', '.join(shipped_policies())}, or give a policy file, "
            "an ONNX file or package.module:factory"
        )
    return load(path)
