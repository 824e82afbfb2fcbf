"""Entry point that detects foreign modules shadowing a package of aero-hil, before any of them is imported.

The packages have common names (`hil`, `model`, `train`), so a file `model.py` beside a script shadows ours.
"""

import sys
from importlib.util import find_spec
from pathlib import Path

PACKAGES = ("hil", "aero", "simulator", "model", "firmware_emulator")
"""Packages required by every part of aero-hil."""


def hidden(*names: str) -> str:
    """Return a sentence naming the module that shadows a package of aero-hil, or ""."""
    for name in names or PACKAGES:
        found = _file(name)
        # This file is beside the packages, both in a checkout and in an installation.
        if found is None or found.name != "__init__.py" or not (found.parents[1] / Path(__file__).name).is_file():
            return (
                f"{found or 'a folder without __init__.py'} has the name of aero-hil's package `{name}`, and is found "
                "first: rename it, or start Python from elsewhere or with -P"
            )
    return ""


def _file(name: str) -> Path | None:
    """Return the file of a top-level module, without importing it; None for a folder without `__init__.py`."""
    try:
        spec = find_spec(name)
    except ValueError:  # already imported, without a module spec
        return Path(getattr(sys.modules[name], "__file__", None) or "a module without a file")
    return Path(spec.origin) if spec is not None and spec.origin is not None else None


def main() -> None:
    """Run the command line."""
    if line := hidden(*PACKAGES, "train"):
        print(f"Error: {line}", file=sys.stderr)
        sys.exit(2)
    from hil.cli import main as commands  # noqa: PLC0415 - after the check for shadowing

    try:
        commands()
    except KeyboardInterrupt:  # a second one, while the first is reported
        sys.exit(130)


if __name__ == "__main__":
    main()
