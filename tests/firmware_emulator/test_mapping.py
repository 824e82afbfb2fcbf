import math
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_emulator.firmware.hands import HANDS
from firmware_emulator.firmware.mapping import to_counts, to_host

U16 = st.integers(0, 65535)
COUNTS = st.integers(0, 4095)

# Goals of both hands, channels 0 to 3, for a row of commands (aero-open-firmware d7bd82e).
TABLE = {
    0: (2048, 3231, 1115, 3278, 2048, 865, 2980, 817),
    3815: (1982, 3163, 1288, 3088, 2114, 933, 2807, 1007),
    16384: (1764, 2936, 1860, 2459, 2332, 1160, 2235, 1636),
    32767: (1480, 2640, 2604, 1640, 2616, 1456, 1491, 2455),
    32768: (1479, 2640, 2605, 1639, 2617, 1456, 1490, 2456),
    49152: (1195, 2344, 3350, 820, 2901, 1752, 745, 3275),
    65526: (911, 2049, 4094, 1, 3185, 2047, 1, 4094),
    65535: (910, 2048, 4095, 0, 3186, 2048, 0, 4095),
}


def window(side, channel):
    return HANDS[side].extend[channel], HANDS[side].grasp[channel]


@pytest.mark.parametrize("word", TABLE)
def test_goals_of_the_table(word):
    goals = [to_counts(word, *window(side, channel)) for side in ("right", "left") for channel in range(4)]
    assert tuple(goals) == TABLE[word]


@pytest.mark.parametrize(
    ("side", "channel", "counts", "word"),
    [
        ("right", 3, 0, 65535),
        ("right", 3, 1, 65515),
        ("right", 3, 2047, 24610),
        ("right", 3, 2048, 24590),
        ("right", 3, 3278, 0),
        ("right", 3, 4095, 0),
        ("right", 0, 2047, 57),
        ("right", 0, 1115, 53729),
        ("right", 1, 2049, 65479),
        ("right", 2, 2048, 20518),
        ("right", 2, 4094, 65513),
        ("left", 3, 2048, 24610),
        ("left", 3, 4094, 65515),
    ],
)
def test_readings_of_the_table(side, channel, counts, word):
    assert to_host(counts, *window(side, channel)) == word


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
