"""The policy that comes with the project, by name."""

from __future__ import annotations

from importlib.resources import as_file, files
from pathlib import Path

from aero.policy.file import Policy, PolicyFileError, load

DEFAULT = "steady"
"""What `aero-hil train steady` made: for any cube on a hand that is corrected for."""
_SUFFIX = ".npz"


def shipped_policies() -> tuple[str, ...]:
    """Return their names."""
    return tuple(sorted(Path(entry.name).stem for entry in files(__name__).iterdir() if entry.name.endswith(_SUFFIX)))


def find_policy(name: str) -> Policy:
    """Return a shipped policy by its name, or the policy in a file by its path.

    Raises:
        PolicyFileError: neither a shipped name nor a policy file that can be run.
    """
    if name in shipped_policies():
        with as_file(files(__name__) / f"{name}{_SUFFIX}") as path:
            return load(path)
    path = Path(name)
    if not path.is_file():
        raise PolicyFileError(
            f"there is no policy {name!r}; shipped is {', '.join(shipped_policies())}, or give a policy file"
        )
    return load(path)
