"""A former name of an argument warns and works as the present one."""

import pytest

from aero import open_hand
from aero.actuation import ActuationMap, CommandWindow
from firmware_emulator.bench import Bench
from firmware_emulator.hand import EmulatedHand

CALLS = {
    "map": lambda **side: ActuationMap.for_firmware("0.2.0", **side),
    "window": lambda **side: CommandWindow.for_firmware("0.2.0", **side),
    "electronics": lambda **side: EmulatedHand(Bench(), start="bare", **side)._config,
}


@pytest.mark.parametrize("call", CALLS.values(), ids=CALLS)
def test_the_former_name_of_the_side_warns_and_works(call):
    with pytest.warns(DeprecationWarning, match=r"hand=\.\.\.\) is now .*side=\.\.\."):
        former = call(hand="left")
    assert former == call(side="left") != call(side="right")


def test_a_hand_is_opened_by_its_former_name():
    with pytest.warns(DeprecationWarning, match=r"side=\.\.\."):
        opening = open_hand("/dev/nothing", hand="middle")
    with pytest.raises(ValueError, match="hand must be one of"), opening:
        pass


def test_a_window_has_its_former_attribute():
    with pytest.warns(DeprecationWarning, match="side"):
        assert CommandWindow.for_firmware("0.2.0", side="left").hand == "left"
