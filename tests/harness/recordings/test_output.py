"""Figures are written as JSON that every reader takes."""

import json
import math

from hypothesis import given
from hypothesis import strategies as st

from hil.recordings.output import json_text

CONTENTS = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(),
    lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner),
    max_leaves=20,
)


def refuse(constant):
    raise AssertionError(constant)


def without_numbers_that_are_none(content):
    if isinstance(content, dict):
        return {name: without_numbers_that_are_none(value) for name, value in content.items()}
    if isinstance(content, list):
        return [without_numbers_that_are_none(value) for value in content]
    return None if isinstance(content, float) and not math.isfinite(content) else content


@given(CONTENTS)
def test_what_could_not_be_measured_is_null(content):
    assert json.loads(json_text(content), parse_constant=refuse) == without_numbers_that_are_none(content)
