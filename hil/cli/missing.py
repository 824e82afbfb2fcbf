"""Meaning of a failed import: a missing extra, another package of the same name, or a defect of aero-hil."""

import sys

PACKAGES = ("aero", "firmware_emulator", "simulator", "model", "hil", "train", "feetech_robots")


def is_ours(module: str | None) -> bool:
    """Return whether aero-hil itself provides the module, so that a failed import is a bug, not a missing extra."""
    return (module or "").partition(".")[0] in PACKAGES


def other_package(error: ImportError) -> str:
    """Return a sentence naming the package that has the name of a required one, such as `serial` on PyPI, or ""."""
    top, _, part = (error.name or "").partition(".")
    if is_ours(top) or (isinstance(error, ModuleNotFoundError) and not part):
        return ""
    found = sys.modules.get(top)
    where = getattr(found, "__file__", None) or f"a folder {top!r}"
    return (
        f"{where} is not the package `{top}` that aero-hil needs ({error}): rename it, or install the right one "
        f"(`serial` comes with pyserial)"
    )
