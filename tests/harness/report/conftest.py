"""One validation of a healthy emulated hand, made once: what the tests of the report take readings away from."""

import pytest

from hil.checks import DEFAULT
from hil.emulated.any_hand import open_target
from hil.verdict.validation import validate


@pytest.fixture(scope="session")
def validated():
    with open_target(seed=3, homed=True) as target:
        return validate(target, (*DEFAULT, "short_staircase", "repeatability"))
