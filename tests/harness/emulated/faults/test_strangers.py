"""Faults outside the catalogue are felt as those in it are, and are gone with their part."""

from contextlib import suppress

import pytest
from drawn import drawn
from figures.strangers import FIFTH, FIRST, FOURTH, SEVENTH, SIXTH, THIRD

from aero.errors import AeroError
from hil.emulated.any_hand import open_target
from hil.emulated.faults import CATALOGUE

CLOSED = (64000, 62000, 60000, 58000, 45000, 48000, 45000)
CABLES_OF_MODEL = ("tendon_range", "tendon_solref_lim", "tendon_solimp_lim", "wrap_prm")
MECHANICS = (*CABLES_OF_MODEL, "jnt_stiffness", "jnt_range", "qpos_spring")
EARLIER = (*FIRST, *THIRD, *FOURTH, *FIFTH)
STORED = ("id", "secondary_id", "baud", "mode", "max_temperature", "min_voltage", "protection_current")
GAINS = ("position_p", "position_d", "kp", "kd", "dead_zone_cw", "dead_zone_ccw", "torque_limit")


def bytes_of(*faults, seconds=12.0):
    """What comes back of a hand that closes and opens, from then on, whatever fails."""
    with suppress(AeroError, ConnectionError), open_target(seed=3, faults=faults) as target:
        move(target, seconds)
        return target.wire.since(0, 0.0)
    return []


def move(target, seconds):
    """Close and open the hand, and read it."""
    hand, clock = target.hand, target.clock
    for step in range(round(seconds / 0.3)):
        hand.command_codes([round(0.1 * (step % 20) * code) if step % 20 < 10 else 0 for code in CLOSED])
        clock.sleep_until(clock.now() + 0.3)
        hand.read_codes()
        hand.read_currents()


def parts_of(bench):
    """Numbers of the mechanics and of the electronics that a fault may change, without the homing's."""
    compiled, hand = bench.mechanics.compiled, bench.electronics
    return (
        {name: getattr(compiled.model, name).tolist() for name in MECHANICS},
        compiled.model.dof_frictionloss[compiled.joint_dofs].tolist(),
        compiled._spool_friction.tolist(),
        [[servo.memory.get(name) for name in (*STORED, *GAINS)] for servo in hand.servos],
        [(servo.parameters, servo.feedback.volts, "write" in vars(servo)) for servo in hand.servos],
        (hand.board.speed, hand.board.torque, hand.board.profile),
    )


def test_none_is_in_the_catalogue_and_each_is_there_once():
    names = [fault.name for fault in FIRST]
    assert len(set(names)) == len(names) >= 30
    assert not set(names) & set(CATALOGUE)


@pytest.mark.parametrize(("newer", "older"), [(SIXTH, EARLIER), (SEVENTH, (*EARLIER, *SIXTH))], ids=["6", "7"])
def test_a_newer_set_repeats_no_older(newer, older):
    names = [fault.name for fault in newer]
    assert len(set(names)) == len(names) == 30
    assert not set(names) & {*CATALOGUE, *(fault.name for fault in older)}


@pytest.mark.parametrize("fault", drawn(FIRST, 3), ids=lambda fault: fault.name)
def test_a_stranger_changes_what_the_driver_sees(fault):
    seconds = 12.0 if fault.at_s < 10.0 else fault.at_s + 10.0
    assert bytes_of(fault, seconds=seconds) != bytes_of(seconds=seconds)


@pytest.mark.parametrize("fault", drawn(FIRST, 3), ids=lambda fault: fault.name)
def test_a_stranger_is_gone_with_its_part(fault):
    with open_target(seed=3) as target:
        bench = target.bench.workbench
        before = bench.assembly.unit
        target.inject(fault)
        assert target.wrong == (fault,)
        target.act(f"replace {fault.part.name.lower()}{f' {fault.channel.label}' if fault.channel is not None else ''}")
        assert bench.present == ()
        assert bench.assembly.unit == before
        assert bench.assembly.link.is_idle


@pytest.mark.parametrize("fault", drawn([*SIXTH, *SEVENTH], 4), ids=lambda fault: fault.name)
def test_a_stranger_of_a_newer_set_leaves_the_hand_as_before_it_moved_with_it(fault):
    with open_target(seed=3) as target:
        bench = target.bench.workbench
        before, unit = parts_of(bench), bench.assembly.unit
        target.inject(fault)
        assert target.wrong == (fault,)
        with suppress(AeroError):
            move(target, 2.4)
        target.act(f"replace {fault.part.name.lower()}{f' {fault.channel.label}' if fault.channel is not None else ''}")
        assert bench.present == ()
        assert bench.assembly.link.is_idle
        assert bench.assembly.unit == unit
        assert parts_of(bench) == before
