"""What ended a run is evidence, and the guard names the channel that it stopped the hand for."""

import pytest

from hil.verdict.ending import GATE, EndSignature
from hil.verdict.run_end import FINISHED, RunEnd, Way
from hil.verdict.signature import MOST


@pytest.mark.parametrize(
    ("reason", "stop", "subject"),
    [
        ("emulated: stopped and opened slowly. middle is at 77 °C (limit 65 °C): let it cool", "hot", "middle"),
        ("emulated: stopped. index's encoder jumped by +37% of its window, at 23544 counts/s", "jumped", "index"),
        ("emulated: stopped. ring moved by -12% of its window without a command (limit 10%)", "moved", "ring"),
        ("emulated: stopped. middle stands at 38% of its window, and was only sent to 0%", "elsewhere", "middle"),
        ("emulated: stopped. thumb_abduction has drawn more than 4 A for 0.3 s", "current", "thumb_abduction"),
        ("emulated: not moved. thumb_flexor draws 6.6 A at rest (limit 4 A)", "at_rest", "thumb_flexor"),
        ("emulated: stopped. positions and currents have repeated to the last digit", "repeated", "hand"),
        ("emulated: stopped. the hand has not answered for 1.00 s (limit 1 s)", "silent", "hand"),
        ("asked about channel 3 (index), the board answered about 4", "SafetyStopError", "hand"),
    ],
)
def test_the_reason_says_why_and_for_which_channel(reason, stop, subject):
    assert EndSignature("SafetyStopError", reason).places == {("ended", stop, subject): MOST}


def test_a_run_that_came_to_its_end_says_nothing():
    assert EndSignature.of(FINISHED) == EndSignature()
    assert EndSignature().places == {}
    assert EndSignature.of(RunEnd(Way.GATE, "presence")).places == {("ended", GATE, "hand"): MOST}
    assert EndSignature.of(RunEnd(Way.DRIVER, "audit", "cut", ConnectionError("cut"))).error == "ConnectionError"
