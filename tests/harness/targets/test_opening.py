"""Opening a target gives what was asked for, or one message that says why not."""

import pytest

import hil
from aero import Channel
from hil import MissingCapabilityError, NoHandError
from hil.emulated.any_hand import open_target
from hil.emulated.faults import parse_fault
from simulator.scene import CUBE


def wire_log(seed, unit="reference"):
    with open_target(seed=seed, unit=unit) as target:
        for level in range(12):
            target.hand.command_codes([4000 * level] * 7)
            target.clock.sleep_until(target.clock.now() + 0.05)
            target.hand.read_codes()
            target.hand.read_currents()
        return target.wire.since(0, 0.0)


def test_the_same_seed_gives_the_same_bytes_at_the_same_times():
    first = wire_log(3)
    assert first == wire_log(3) != wire_log(4)
    assert len(first) > 48


def test_an_emulated_hand_is_opened_as_asked():
    with open_target(firmware="pre", side="left", seed=5) as target:
        assert (target.firmware, target.side, target.seed, target.unit) == ("pre", "left", 5, "reference")
        assert target.map.window.side == "left"
        assert not target.real_time
        assert target.describe() == "left hand on emulated, firmware pre, unit reference, seed 5"
        assert target.truth.plant.joint_angles().shape == (16,)


@pytest.mark.parametrize("real_time", [False, True])
def test_an_emulated_hand_runs_in_the_time_that_was_asked_for(real_time):
    with hil.emulate(real_time=real_time) as target:
        assert target.real_time is real_time


def test_a_missing_port_is_named_with_what_to_try():
    context = open_target("/dev/ttyNoSuchHand")
    with pytest.raises(NoHandError, match=r"(?s)/dev/ttyNoSuchHand.*ttyACM0"), context:
        pytest.fail("there is no such port")


def test_a_hand_beside_a_cube_may_have_faults():
    with open_target(cube=CUBE, faults=[parse_fault("cable_snapped:ring@0.3")]) as target:
        target.hand.command_codes([20000] * 7)
        target.clock.sleep_until(target.clock.now() + 1.0)
        slack = target.truth.plant.slack()
    assert slack[Channel.RING] > 0.5 > slack[Channel.PINKY]


def test_a_hand_on_a_pseudo_terminal_answers_and_has_no_ground_truth():
    with open_target("pty", seed=1) as target:
        assert target.real_time
        assert target.hand.read_codes().shape == (7,)
        with pytest.raises(MissingCapabilityError, match="--hil=emulated"):
            _ = target.truth


def test_a_shell_completes_every_public_name():
    assert set(hil.__all__) <= set(dir(hil))
