"""The name under which any unit is known: a shipped file, a file of the user's, or a seed of the healthy population."""

from __future__ import annotations

from model.units import Unit, load_unit
from model.units.plausible import plausible_unit

PLAUSIBLE = "plausible:"
"""Before the seed of a unit of the healthy population."""


def unit_named(name: str) -> Unit:
    """Return a unit by name: `reference`, `PATH.toml`, or `plausible:SEED` for one that somebody could have built.

    Raises:
        ValueError: there is no such unit, its file has a mistake, or the seed is no whole number from 0 on.
    """
    if not name.startswith(PLAUSIBLE):
        return load_unit(name)
    seed = name.removeprefix(PLAUSIBLE)
    if not seed.isdecimal():
        raise ValueError(f"unit {name!r}: write {PLAUSIBLE}SEED with a whole number from 0 on")
    return plausible_unit(int(seed))
