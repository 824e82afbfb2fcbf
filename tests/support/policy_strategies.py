"""Hypothesis strategies for policies, separate from their builders because tests/hil also runs without Hypothesis."""

import numpy as np
from hypothesis import strategies as st

seeds = st.integers(0, 2**32 - 1)
lengths = st.lists(st.floats(-2, 2), min_size=7, max_size=7).map(np.array)
actions = st.lists(st.floats(-1, 1), min_size=7, max_size=7).map(np.array)
finite_observations = st.lists(st.floats(allow_nan=False, allow_infinity=False), min_size=14, max_size=14).map(np.array)
