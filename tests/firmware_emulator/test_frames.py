import math
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_emulator.firmware.frames import to_counts, to_host
from firmware_emulator.firmware.hands import HANDS

U16 = st.integers(0, 65535)
COUNTS = st.integers(0, 4095)


def window(side, channel):
    return HANDS[side].extend[channel], HANDS[side].grasp[channel]


@given(U16, COUNTS, COUNTS)
def test_goals_follow_exact_arithmetic(word, extend, grasp):
    exact = extend + math.trunc(Fraction(word * (grasp - extend), 65535))
    expected = word * 4095 // 65535 if extend == grasp == 0 else min(max(exact, 0), 4095)
    assert to_counts(word, extend, grasp) == expected


@given(st.integers(0, 0xFFFF), COUNTS, COUNTS)
def test_readings_stay_in_range_and_follow_exact_arithmetic_without_overflow(position, extend, grasp):
    word = to_host(position, extend, grasp)
    assert 0 <= word <= 65535
    if grasp != extend and abs(position - extend) < 32769:
        exact = math.trunc(Fraction((position - extend) * 65535, grasp - extend))
        assert word == min(max(exact, 0), 65535)


@pytest.mark.parametrize(
    ("side", "channel", "worst"), [("right", 0, 58), ("right", 1, 56), ("left", 2, 22), ("left", 6, 20)]
)
def test_a_reached_goal_reads_back_at_most_one_quantum_below_the_command(side, channel, worst):
    errors = [
        word - to_host(to_counts(word, *window(side, channel)), *window(side, channel)) for word in range(0, 65536, 7)
    ]
    assert min(errors) >= 0
    assert max(errors) <= worst


def test_a_slightly_negative_position_reads_as_the_wrong_end():
    """The sign bit is taken for a magnitude: one count beyond full grasp reads as fully open, and so on."""
    assert to_host(0x8001, 3278, 0) == 0
    assert to_host(0x8001, 817, 4095) == 65535
    # The product overflows once the magnitude exceeds the extend value, and the other end comes out.
    assert to_host(0x8000 | 3279, 3278, 0) == 65535
