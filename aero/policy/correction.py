"""The correction of the cables that healthy hands need on average: what a hand gets of which nothing is known.

A cable that is too long or too short moves the joints behind a shaft that reads as it should. Every thumb that was
drawn is off by nearly the same, so its mean is a better guess than zero; `train/typical_correction.py` computes it.
"""

from __future__ import annotations

import tomllib
from functools import cache
from importlib.resources import files

from aero.channels import Channel

NO_CORRECTION = (0.0,) * len(Channel)
"""For a hand that is as the actuation map describes it."""
FILE = "typical_correction.toml"


@cache
def typical_correction() -> tuple[float, ...]:
    """Return by how much longer each channel must be commanded than the map says, (7,), m, abduction rad."""
    table = tomllib.loads((files("aero.policy.shipped") / FILE).read_text(encoding="utf-8"))
    return tuple(float(table["mean"][channel.label]) for channel in Channel)
