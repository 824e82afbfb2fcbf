"""What runs before any package of aero-hil is imported: which other module has the name of one of them.

The packages have everyday names, `hil`, `model`, `train`; a file `model.py` beside a script hides ours from it.
"""

from __future__ import annotations

import sys
from importlib.util import find_spec
from pathlib import Path

PACKAGES = ("hil", "aero", "model", "firmware_emulator")
"""Packages that nothing of ours works without."""


def hidden(*names: str) -> str:
    """Return which other module is found under the name of a package of ours, in a sentence; empty where none is."""
    for name in names or PACKAGES:
        found = _file(name)
        # This file lies beside the packages, in a checkout as in an installation.
        if found is None or found.name != "__init__.py" or not (found.parents[1] / Path(__file__).name).is_file():
            return (
                f"{found or 'a folder without __init__.py'} has the name of aero-hil's package `{name}`, and is found "
                "first: rename it, or start Python from elsewhere or with -P"
            )
    return ""


def _file(name: str) -> Path | None:
    """Return the file of a top-level module, without importing it; None for a folder that is no package."""
    try:
        spec = find_spec(name)
    except ValueError:  # imported by something that says nothing about its origin
        return Path(getattr(sys.modules[name], "__file__", None) or "a module without a file")
    return Path(spec.origin) if spec is not None and spec.origin is not None else None


def main() -> None:
    """Run the command line."""
    if line := hidden(*PACKAGES, "train"):
        print(f"Error: {line}", file=sys.stderr)
        sys.exit(2)
    from hil.cli import main as commands  # noqa: PLC0415 - only now it is known to be ours

    commands()


if __name__ == "__main__":
    main()
