import dataclasses
from itertools import pairwise

import numpy as np
import pytest
from recorded import excitation_of

from aero import AeroHand
from aero.channels import FINGERS, Channel
from aero.protocol import MAX_CODE
from aero.safety import SafetyStopError, Thresholds
from firmware_emulator.firmware.hands import SHAFT_OF_SERVO
from firmware_emulator.links.in_process import InProcessLink
from hil.emulated.any_hand import open_target
from hil.emulated.emulated_hand import build_emulated
from hil.emulated.emulated_spec import EmulatedSpec
from hil.recordings.recorder import Recorder
from model.units import load_unit
from train.identification.calibration import calibrate
from train.identification.cross_validation import held_out_rms
from train.identification.excitation import Excitation, play
from train.identification.search import pooled_rms, search
from train.identification.trace import Trace, closing_current_sign
from train.identification.trace_replay import READ, replay
from train.identification.unit_file import unit_toml
from train.identification.unit_parameters import FREE, UnitModel

SHIPPED = load_unit("reference")
REFERENCE = dataclasses.replace(SHIPPED, hand=dataclasses.replace(SHIPPED.hand, cable_friction_spread=0.0))
"""The recorded hand with closures that are alike: how they differ is chance, which no replay has."""


def short(height=0.3):
    """All fingers and the flexor at once: rest, a step, rest, a ramp back; little more than a second."""
    motion = np.concatenate([np.zeros(5), np.full(20, height), np.linspace(height, 0.0, 25), np.zeros(8)])
    fractions = np.zeros((len(motion), len(Channel)))
    fractions[:, [*FINGERS, Channel.THUMB_FLEXOR]] = motion[:, None]
    return Excitation(f"short {height}", fractions)


def recorded(unit, plan, tmp_path, side="right"):
    """Record an excitation of a hand of this unit."""
    path = tmp_path / "hand.toml"
    path.write_text(unit_toml(unit, "", {}), encoding="utf-8")
    with open_target("emulated", unit=str(path), side=side, seed=3) as target:
        return Trace.from_recording(excitation_of(target, plan), plan.name)


@pytest.fixture(scope="module")
def trace(tmp_path_factory):
    return recorded(REFERENCE, short(), tmp_path_factory.mktemp("unit"))


def test_a_hand_predicts_itself(trace):
    predicted = replay(trace, REFERENCE)
    assert np.sqrt(np.mean((predicted.counts - trace.counts) ** 2)) < 12.0
    assert np.abs(predicted.counts[-1] - trace.counts[-1]).max() <= 3.0
    assert np.isfinite(predicted.currents).all()
    assert np.isfinite(predicted.temperatures).all()


def through_every_byte(trace, unit, phase_s):
    """Replay with a driver on the link, as the trace was recorded."""
    electronics, _ = build_emulated(unit, EmulatedSpec())
    for servo, shaft in zip(electronics.servos, SHAFT_OF_SERVO, strict=True):
        servo.heat_to(trace.temperatures[0, shaft] + 0.5)
    events = sorted(
        [(t, 1, i) for i, t in enumerate(trace.t_command)] + [(t, 0, i) for i, t in enumerate(trace.t_read)]
    )
    clock, read = electronics.clock, []
    with AeroHand(InProcessLink(electronics), clock) as hand:
        hand.command_codes(trace.codes[0])
        start = clock.now() + 0.5 + phase_s - events[0][0]
        for t, is_command, row in events:
            clock.sleep_until(start + t)
            if is_command:
                hand.command_codes(trace.codes[row])
            else:
                read.append((hand.read_codes(), hand.read_currents(), hand.read_temperatures()))
    codes, currents, temperatures = (np.array(rows) for rows in zip(*read, strict=True))
    counts = np.rint(codes * trace.spans_counts / MAX_CODE)
    return counts, currents * closing_current_sign("right"), temperatures


@pytest.mark.parametrize("phase_s", [0.0, 0.0025, 0.0071])
def test_a_replay_reads_what_a_driver_gets_through_every_byte(trace, phase_s):
    predicted = replay(trace, REFERENCE, phase_s=phase_s)
    read = predicted.counts, predicted.currents, predicted.temperatures
    for of_replay, of_driver in zip(read, through_every_byte(trace, REFERENCE, phase_s), strict=True):
        assert np.array_equal(of_replay, of_driver)


def test_the_phase_of_the_telemetry_is_what_is_left(trace):
    by_phase = [
        np.sqrt(np.mean((replay(trace, REFERENCE, phase_s=p, fields=READ[:1]).counts - trace.counts) ** 2))
        for p in np.arange(0.0, 0.01, 0.001)
    ]
    assert min(by_phase) < 1.5 < max(by_phase)


def test_calibration_finds_a_changed_hand(tmp_path):
    """The gain of a hand with weaker servos is found from a short recording."""
    truth = dataclasses.replace(
        REFERENCE, servos=dataclasses.replace(REFERENCE.servos, duty_per_count=0.8 * REFERENCE.servos.duty_per_count)
    )
    traces = (recorded(truth, short(0.35), tmp_path),)
    free = tuple(number for number in FREE if number.name == "servos.duty_per_count")
    model = UnitModel(REFERENCE, traces, free=free, phases_s=(0.0, 0.005))
    start = pooled_rms(model.residuals([np.zeros(len(free))], (0.0,)))
    found = search(model, iterations=2)
    unit = model.unit(found.x)
    assert unit.servos.duty_per_count == pytest.approx(truth.servos.duty_per_count, rel=0.05)
    assert pooled_rms(found.residuals) < 0.6 * start


def test_calibration_finds_the_tension_of_the_open_hand(tmp_path):
    """The encoders of taut cables read zero, whatever they pull: their currents tell it."""
    tighter = list(REFERENCE.hand.cable_take_up)
    tighter[Channel.INDEX] -= 1.5e-4
    tighter[Channel.RING] += 1e-4
    truth = dataclasses.replace(REFERENCE, hand=dataclasses.replace(REFERENCE.hand, cable_take_up=tuple(tighter)))
    traces = (recorded(truth, short(0.1), tmp_path),)
    fingers = {channels: (channels,) for channels in FINGERS}
    free = tuple(n for n in FREE if n.name == "hand.cable_take_up" and n.channels in fingers.values())
    model = UnitModel(REFERENCE, traces, free=free, phases_s=(0.0, 0.005))
    found = model.unit(search(model, iterations=3).x).hand.cable_take_up
    for channel in (Channel.INDEX, Channel.RING):
        assert found[channel] == pytest.approx(tighter[channel], abs=5e-5)


def test_calibration_finds_how_far_the_supply_sags(tmp_path):
    truth = dataclasses.replace(REFERENCE, hand=dataclasses.replace(REFERENCE.hand, supply_sag=0.15))
    start = dataclasses.replace(REFERENCE, hand=dataclasses.replace(REFERENCE.hand, supply_sag=0.05))
    traces = (recorded(truth, short(0.9), tmp_path),)
    free = tuple(number for number in FREE if number.name == "hand.supply_sag")
    model = UnitModel(start, traces, free=free, phases_s=(0.0, 0.005))
    assert model.unit(search(model, iterations=2).x).hand.supply_sag == pytest.approx(0.15, rel=0.35)


FRICTION = tuple(number for number in FREE if number.name == "hand.spool_friction")


def test_a_single_recording_is_scored_on_parts_left_out_and_only_what_it_moves_is_fitted(trace):
    seen = []
    result = calibrate([trace], REFERENCE, free=FRICTION, progress=lambda *at: seen.append(at))
    assert sum(len(part[0]) for part in result.held_out) == len(trace.t_read)
    assert held_out_rms(result.held_out) < 12.0
    assert all(before < after for (before, _), (after, _) in pairwise(seen))
    assert all(done <= about for done, about in seen)
    assert sum(done == about for done, about in seen) < 0.2 * len(seen)
    low, high = result.intervals["hand.spool_friction"]
    moving = [*FINGERS, Channel.THUMB_FLEXOR]
    assert [channel for channel in Channel if low[channel] < high[channel]] == moving
    for channel in set(Channel) - set(moving):
        assert result.unit.hand.spool_friction[channel] == REFERENCE.hand.spool_friction[channel]


def test_a_recording_that_the_guard_ends_says_so_and_leaves_the_hand_open():
    with open_target("emulated", guarded=True, thresholds=Thresholds(current_a=0.4, current_s=0.05)) as target:
        recorder = Recorder(target, "excitation")
        with pytest.raises(SafetyStopError, match="drawn"):
            play(target, recorder, short())
        errors = [event.text for event in recorder.finish(ended=False).events if event.severity == "error"]
        assert len(errors) == 1
        assert "drawn" in errors[0]
        electronics = target.truth.electronics
        electronics.clock.sleep_until(electronics.clock.now() + 0.5)
        electronics.advance_plant()
        assert np.all(target.truth.plant.angles() < 0.2)


def test_an_interruption_leaves_the_hand_open():
    def interrupt(done, _doing):
        if done > 0.5:
            raise KeyboardInterrupt

    with open_target("emulated") as target:
        with pytest.raises(KeyboardInterrupt):
            excitation_of(target, short(), progress=interrupt)
        target.clock.sleep_until(target.clock.now() + 0.5)
        assert np.all(target.hand.read_codes() < 0.05 * 65535)


@pytest.mark.parametrize(
    ("changes", "asked", "message"),
    [
        ({"firmware": "pre"}, "0.2.0", "several firmwares, 0.2.0, pre"),
        ({"side": "left"}, None, "of a left and of a right hand"),
    ],
)
def test_a_recording_is_fitted_as_what_its_header_says(trace, changes, asked, message):
    with pytest.raises(ValueError, match=message):
        calibrate([trace, dataclasses.replace(trace, **changes)], REFERENCE, firmware=asked)


def test_a_left_hand_is_predicted_by_the_unit_that_it_reflects(trace, tmp_path):
    """Readings of a left hand are those of the right one; replayed as a right hand, its currents would turn round."""
    left = recorded(REFERENCE, short(), tmp_path, "left")
    assert left.side == "left"
    predicted, of_right = replay(left, REFERENCE, side="left"), replay(trace, REFERENCE)
    np.testing.assert_allclose(predicted.counts, of_right.counts, atol=12.0)
    assert np.sqrt(np.mean((predicted.counts - left.counts) ** 2)) < 12.0
    assert np.sqrt(np.mean((predicted.currents - left.currents) ** 2)) < 0.1
