"""Any plausible hand, driven in any way: finite, one-way, bounded, and at rest when let go."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from servo_law import DAMPING, STALL, STIFFNESS

from firmware_emulator.plant import Drive
from model import BuiltHandParameters, BuiltHandPlant

DEFAULTS = BuiltHandParameters()


def scaled(values: tuple[float, ...], factor: float) -> tuple[float, ...]:
    return tuple(factor * value for value in values)


def channels(low: float, high: float) -> st.SearchStrategy[tuple[float, ...]]:
    return st.tuples(*[st.floats(low, high)] * 7)


@st.composite
def hands(draw: st.DrawFn) -> BuiltHandParameters:
    """Hands as they could come off a bench: from a new one with loose cables to a worn, stiff one."""
    spring = draw(st.floats(0.5, 2.0))
    return BuiltHandParameters(
        rotor_inertia=draw(channels(4e-4, 1.6e-3)),
        supply_ratio=draw(st.floats(0.8, 1.3)),
        spool_friction=draw(channels(0.01, 0.06)),
        spool_damping=draw(channels(0.0, 0.01)),
        cable_take_up=draw(channels(0.0, 0.01)),
        cable_compliance=draw(st.floats(0.0, 3e-5)),
        winding_scale=draw(channels(0.85, 1.2)),
        spring_open=scaled(DEFAULTS.spring_open, spring),
        spring_closed=scaled(DEFAULTS.spring_closed, spring),
        joint_friction=scaled(DEFAULTS.joint_friction, draw(st.floats(0.0, 3.0))),
        joint_damping=scaled(DEFAULTS.joint_damping, draw(st.floats(0.2, 3.0))),
        stop_compliance=draw(st.floats(0.0, 0.02)),
        contacts=draw(st.booleans()),
    )


def drives() -> st.SearchStrategy[Drive]:
    return st.one_of(
        st.just(Drive(powered=False)),
        st.builds(
            Drive,
            setpoint=st.floats(-2.0, 7.0),
            stiffness=st.just(STIFFNESS),
            damping=st.just(DAMPING),
            limit=st.floats(0.0, STALL),
        ),
        st.builds(Drive, torque=st.floats(-STALL, STALL), limit=st.just(STALL)),
    )


events = st.lists(st.tuples(st.integers(0, 6), drives(), st.floats(1e-4, 0.15)), min_size=1, max_size=25)


def check(plant: BuiltHandPlant) -> None:
    assert np.all(np.isfinite(plant.angles()))
    assert np.all(np.isfinite(plant.speeds()))
    assert np.all(plant.cable_tensions() >= 0.0)
    assert np.all(plant.slack() >= 0.0)
    angles = plant.joint_angles()
    assert np.all(angles > -0.15)
    assert np.all(angles < np.array(plant.parameters.closed_stop) + 0.15)
    assert np.all(np.abs(plant.efforts()) <= STALL)


@settings(max_examples=40, deadline=None)
@given(hands(), events)
def test_stays_finite_one_way_and_within_its_stops(parameters, events):
    plant = BuiltHandPlant(parameters)
    for shaft, drive, span in events:
        plant.drive(shaft, drive)
        plant.advance_to(plant.time + span)
        check(plant)


@settings(max_examples=15, deadline=None)
@given(hands(), events)
def test_comes_to_rest_when_let_go(parameters, events):
    """No drive, no energy: whatever happened before, everything stops."""
    plant = BuiltHandPlant(parameters)
    for shaft, drive, span in events:
        plant.drive(shaft, drive)
        plant.advance_to(plant.time + span)
    for shaft in range(7):
        plant.drive(shaft, Drive(powered=False))
    # Nothing brakes an unpowered spool but its dry friction; none runs faster than 30 rad/s.
    coasting = max(30.0 * i / f for i, f in zip(parameters.rotor_inertia, parameters.spool_friction, strict=True))
    # A spring that barely beats the friction moves a damped spool slowly: 0.012 N m s/rad over 0.01 N m/rad.
    creeping = 10.0 * 1.2
    plant.advance_to(plant.time + creeping + coasting)
    resting = plant.angles()
    plant.advance_to(plant.time + 0.2)
    assert np.abs(plant.angles() - resting).max() < 2e-3


@settings(max_examples=15, deadline=None)
@given(st.floats(0.0, 1.5), st.floats(0.0, 1.5))
def test_kinetic_energy_only_falls_in_a_hand_without_springs_and_drives(first, second):
    """Spools and joints that were set in motion slow down; nothing feeds them."""
    still = BuiltHandParameters(spring_open=(0.0,) * 16, spring_closed=(0.0,) * 16, gravity=0.0, contacts=False)
    plant = BuiltHandPlant(still)
    plant.drive(0, Drive(torque=0.05 + 0.2 * first, limit=1.0))
    plant.drive(3, Drive(torque=0.05 + 0.2 * second, limit=1.0))
    plant.advance_to(0.05)
    for shaft in range(7):
        plant.drive(shaft, Drive(powered=False))
    energies = []
    for _ in range(100):
        plant.advance_to(plant.time + 0.002)
        energies.append(float(np.sum(np.array(still.rotor_inertia) * plant.speeds() ** 2) / 2))
    assert energies[-1] < 1e-6
    assert max(energies) <= energies[0] * 1.001
