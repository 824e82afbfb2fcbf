"""Validations of emulated hands, each run once for all tables that read from it."""

from __future__ import annotations

from functools import cache

import hil
from figures.cells import Tolerance
from hil.verdict.judged_run import Validation
from hil.verdict.validation import validate

SEEDED = Tolerance(
    "the same seed gives the same bytes; MuJoCo 3.17 and 4.0 differ by up to 5 % where dry friction decides",
    last_place=0.1,
    other_physics=0.06,
)
"""Of figures of emulated hands on virtual time."""

EXACT = Tolerance("a closed form: nothing but rounding", last_place=0.1)


@cache
def validation(unit: str, firmware: str, *experiments: str) -> Validation:
    """Validate a homed emulated hand, seed 0, as `aero-hil validate --unit UNIT --firmware FIRMWARE` does."""
    with hil.open_target("emulated", unit=unit, firmware=firmware, seed=0, homed=True) as target:
        return validate(target, experiments)
