"""A supply that sags: the servos measure it, and a board that hangs on it restarts."""

from contextlib import suppress
from itertools import permutations

import pytest

from aero import Channel
from aero.errors import LinkTimeoutError
from firmware_emulator.servo.models import REGISTERS
from hil.emulated.any_hand import open_target
from hil.emulated.faults import parse_fault

VOLTAGE = REGISTERS["present_voltage"].address


def session(fault):
    """Lowest voltage that servo 3 measured, V, and the starts of the board that the driver saw."""
    with open_target(faults=[parse_fault(fault)], seed=1) as target:
        electronics, hand, lowest = target.truth.electronics, target.hand, 99
        for turn in range(6):
            hand.command_codes([65535 * (turn % 2 == 0)] * len(Channel))
            for _ in range(10):
                target.clock.sleep_until(target.clock.now() + 0.05)
                lowest = min(lowest, electronics.servos[3].read(VOLTAGE, 1)[0])
        target.clock.sleep_until(target.clock.now() + 6.0)
        with suppress(LinkTimeoutError):  # a board that restarts again and again is at its homing
            hand.read_codes()
        return lowest / 10, hand.restarts


def test_servos_measure_a_supply_that_sags():
    volts, restarts = session("supply_sags=0.9")
    assert volts < 4.0
    assert restarts == 0


@pytest.mark.parametrize(("severity", "restarts"), [(0.9, True), (0.05, False)])
def test_a_board_on_a_supply_that_sags_below_3_6_v_restarts(severity, restarts):
    volts, seen = session(f"supply_browns_out={severity}")
    assert (seen > 0) is restarts
    assert (volts < 4.0) is restarts


@pytest.mark.parametrize("order", list(permutations(("supply_low=0.4", "encoder_offset:ring=20"))))
def test_the_supply_that_faults_leave_is_their_product(order):
    """An encoder behind it once gave a hand its full supply back."""
    with open_target(faults=[parse_fault(fault) for fault in order], seed=1) as target:
        assert target.bench.workbench.assembly.supply_left() == pytest.approx(0.6, abs=0.05)
