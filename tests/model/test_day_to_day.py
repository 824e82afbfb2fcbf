"""What differs from day to day and from closure to closure: pretension, sheath friction, a supply that sags."""

from dataclasses import replace

import numpy as np
import pytest
from servo_law import COUNT, push, settle, towards

from aero.channels import Channel
from model import BuiltHandParameters, BuiltHandPlant

SHEATHED = BuiltHandParameters(cable_friction=(0.5,) * 7, spool_friction=(0.002,) * 7)
INDEX = Channel.INDEX


def resting_counts(tighter_m, *, closed_before):
    """How far the index's shaft rests behind its goal at the open hand, counts."""
    plant = BuiltHandPlant(replace(SHEATHED, cable_take_up=(-tighter_m,) * 7))
    if closed_before:
        plant.drive(INDEX, towards(2.0))
        settle(plant, 0.5)
    plant.drive(INDEX, towards(0.0))
    for _ in range(100):
        settle(plant, 0.01)
    return -plant.angles()[INDEX] / COUNT


def test_a_shorter_cable_pulls_harder_until_the_spring_gives_way():
    slack, *taut = (resting_counts(tighter, closed_before=False) for tighter in (-1e-3, 0.5e-4, 1e-4, 4e-4))
    assert slack == pytest.approx(0.0, abs=0.5)
    assert 0.0 < taut[0] < taut[1] < taut[2]
    springs = resting_counts(4.9e-4, closed_before=False)
    assert springs == pytest.approx(taut[2], rel=0.1)


def test_the_first_closure_frees_a_cable_from_what_its_sheath_held():
    """A recorded index rested at 260 mA before its first closure and at 75 mA after it."""
    assert resting_counts(2e-4, closed_before=True) < 0.6 * resting_counts(2e-4, closed_before=False)


def closures(spread, times=4, seed=0):
    """Where an index comes to rest at each of several closures, counts."""
    plant = BuiltHandPlant(replace(SHEATHED, cable_friction_spread=spread), seed=seed)
    stops = []
    for _ in range(times):
        for goal in (2.5, 0.3):
            plant.drive(INDEX, towards(goal))
            for _ in range(50):
                settle(plant, 0.01)
            stops.append(plant.angles()[INDEX] / COUNT)
    return np.array(stops[::2])


def test_closures_differ_as_their_friction_does():
    assert np.ptp(closures(0.0)) < 0.05
    assert 0.3 < np.ptp(closures(0.15)) < 8.0
    assert np.array_equal(closures(0.15), closures(0.15))
    assert np.ptp(closures(0.15) - closures(0.15, seed=1)) > 0.3


def pushed(sag, channels):
    """Speeds that a push of some shafts gives in 20 ms, rad/s."""
    loose = BuiltHandParameters(cable_take_up=(0.5,) * 7, supply_sag=sag)
    plant = BuiltHandPlant(loose)
    for channel in channels:
        plant.drive(channel, push(0.4))
    for _ in range(10):
        settle(plant, 0.002)
    return plant.speeds()


def test_a_supply_sags_with_what_all_windings_draw():
    alone, together, firm = pushed(0.2, [INDEX]), pushed(0.2, Channel), pushed(0.0, Channel)
    assert together[INDEX] < alone[INDEX] < firm[INDEX]
    assert np.all(together < firm)


def test_a_supply_recovers_when_nothing_draws():
    plant = BuiltHandPlant(BuiltHandParameters(supply_sag=0.2))
    for channel in Channel:
        plant.drive(channel, push(0.4))
    settle(plant, 0.01)
    settle(plant, 0.01)
    assert plant.compiled.supply < 0.95
    for channel in Channel:
        plant.drive(channel, push(0.0))
    settle(plant, 0.01)
    assert plant.compiled.supply == 1.0
