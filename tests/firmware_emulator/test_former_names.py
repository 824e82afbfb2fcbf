import pytest

from firmware_emulator.bench import Bench
from firmware_emulator.hand import EmulatedHand


def test_the_former_name_of_the_side_warns_and_works():
    with pytest.warns(DeprecationWarning, match=r"side=\.\.\."):
        former = EmulatedHand(Bench(), hand="left", start="bare")
    assert former._config == EmulatedHand(Bench(), side="left", start="bare")._config
