"""What is said before a hand moves: what moves, for how long, how to stop it."""

import pytest

from aero.safety import Thresholds
from hil.dialogue.before_moving import before_moving, motion
from hil.emulated.any_hand import open_target

FULLY, OPEN = (1.0,) * 7, (0.0,) * 7
NUDGES = (0.2, 0.2, 0.2, 0.2, 0.1, 0.1, 0.1)
THUMB = (0.0, 0.0, 0.0, 0.0, 1.0, 0.5, 0.5)


@pytest.fixture(scope="module")
def guarded():
    with open_target(guarded=True, thresholds=Thresholds(current_a=3.5, temperature_c=60.0)) as target:
        yield target


@pytest.mark.parametrize(
    ("furthest", "seconds", "said"),
    [
        (FULLY, 193.0, "Fingers and thumb will close fully for about 190 s."),
        (NUDGES, 9.2, "Fingers and thumb will close by up to 20 % for about 9 s."),
        (THUMB, 16.0, "Thumb will close fully for about 16 s."),
    ],
)
def test_one_line_says_what_moves_how_long_and_what_stops_it(guarded, furthest, seconds, said):
    rest = " Keep clear. Ctrl-C opens the hand. It stops at 3.5 A or 60 °C."
    assert before_moving(guarded, furthest, seconds).text == said + rest


def test_nothing_moves(guarded):
    assert before_moving(guarded, OPEN, 1.0).text == "Nothing will move."


def test_an_unguarded_hand_has_nothing_that_stops_it():
    assert motion(FULLY, 10.0, None).text.endswith("This hand is not guarded: nothing stops it.")


def test_an_emulated_hand_needs_nobody_to_keep_clear():
    with open_target() as target:
        said = before_moving(target, FULLY, 10.0).text
    assert said == "Fingers and thumb will close fully for about 10 s of hand time. The hand is emulated."
