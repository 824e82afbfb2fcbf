"""How long a real fault lasts before the guard begins to open the hand, on an idle host and on one that is late.

The table of docs/safety.md: `pytest -s -m "slow or not slow" tests/safety/test_stopping_times.py`.
"""

import dataclasses

import pytest
from guarded_hands import BusyHost, Tampered, close, guarded, wait

from aero import Channel
from aero.channels import WIRE_ORDER
from aero.safety import SafetyStopError, Thresholds

LATE = {"idle": 0.0, "late": 0.05}
"""Share of the readings that are late by up to 0.1 s."""
SEEDS = [0, pytest.param(1, marks=pytest.mark.slow), pytest.param(2, marks=pytest.mark.slow)]


def time_to_opening(target, fault, *, wait_s=6.0):
    """Do what makes a hand faulty, and return the time until the guard opens it, s."""
    began, openings = target.clock.now(), []
    opening = target.hand._open
    target.hand._open = lambda reason, **how: (openings.append(target.clock.now()), opening(reason, **how))
    fault(target)
    with pytest.raises(SafetyStopError):
        wait(target, wait_s)
    return openings[0] - began


def shift_zero(counts, channel=Channel.MIDDLE):
    def shift(target):
        servo = target.capability("electronics").servos[WIRE_ORDER.index(channel)]
        servo.frame.set_offset(counts)
        servo.feedback.invalidate()

    return shift


def measured(name, late, seed, *, fault, before, most_s, **options):
    with guarded(link=lambda electronics: BusyHost(electronics, seed), **options) as target:
        before(target)
        target.wire._transport.late = LATE[late]
        wait(target, 0.5 + 0.013 * seed)
        took = time_to_opening(target, fault)
    print(f"{name}, {late}, seed {seed}: {took:.2f} s")
    assert took < most_s


def resting(target):
    close(target, Channel.MIDDLE, share=0.3)
    wait(target, 3.0)


@pytest.mark.parametrize("late", LATE)
@pytest.mark.parametrize("seed", SEEDS)
def test_a_jump(late, seed):
    measured("jump of 900 counts", late, seed, fault=shift_zero(900), before=resting, most_s=0.5)


@pytest.mark.parametrize("late", LATE)
@pytest.mark.parametrize("seed", SEEDS)
def test_a_channel_that_runs_away(late, seed):
    def runs_away(drive):
        return dataclasses.replace(drive, setpoint=4.0) if drive.setpoint > 0.5 else drive

    measured(
        "runaway",
        late,
        seed,
        fault=lambda target: close(target, Channel.PINKY, share=0.2),
        before=close,
        most_s=1.0,
        rewire=lambda plant: Tampered(plant, Channel.PINKY, runs_away),
    )


@pytest.mark.parametrize("late", LATE)
@pytest.mark.parametrize("seed", SEEDS)
def test_a_blocked_thumb(late, seed):
    """From the command on: it meets the palm after about 0.25 s."""
    measured(
        "blocked at 4.5 A",
        late,
        seed,
        fault=lambda target: close(target, Channel.THUMB_CMC_FLEXION),
        before=close,
        most_s=1.5,
        thresholds=Thresholds(stop_torque=700),
    )


@pytest.mark.parametrize("late", LATE)
@pytest.mark.parametrize("seed", SEEDS)
def test_a_channel_without_torque(late, seed):
    measured(
        "no torque",
        late,
        seed,
        fault=lambda target: close(target, Channel.RING, share=0.9),
        before=close,
        most_s=3.0,
        rewire=lambda plant: Tampered(plant, Channel.RING, lambda drive: type(drive)(powered=False)),
    )
