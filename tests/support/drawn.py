"""A sample of many parameters by default, and the others in `slow`."""

import random

import pytest


def drawn(values, count):
    """Return the parameters, all but `count` of them marked `slow`; the same ones each time, for each worker."""
    values = list(values)
    chosen = random.Random(1).sample(range(len(values)), count)
    return [
        pytest.param(*(value if isinstance(value, tuple) else (value,)), marks=() if k in chosen else pytest.mark.slow)
        for k, value in enumerate(values)
    ]
