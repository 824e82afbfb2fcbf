"""Every threshold is provoked on the emulated hand, and every way out leaves it open and limp."""

import numpy as np
import pytest
from build_errors import heat, rename
from hypothesis import given
from hypothesis import strategies as st

from aero.channels import WIRE_ORDER, Channel
from hil import NoHandError, open_target
from hil.guarded_hand import SafetyAbortError
from hil.report import render_report
from hil.safety import SafetyLimits, SafetyMonitor
from hil.validation import validate

QUIET = SafetyLimits()
GOAL_TORQUE = "goal_torque"
SPANS = np.array([3278, 3278, 3278, 3278, 1138, 1183, 2980])


def hold(target, codes, seconds):
    """Keep commanding, as every experiment does."""
    until = target.clock.now() + seconds
    while target.clock.now() < until:
        target.hand.command_codes(codes)
        target.clock.sleep_until(target.clock.now() + 0.02)


def servo(target, channel):
    return target.capability("electronics").servos[WIRE_ORDER.index(channel)]


def is_open_and_limp(target):
    plant = target.capability("ground_truth")
    target.clock.sleep_until(target.clock.now() + 0.5)
    torques = {s.memory.get(GOAL_TORQUE) for s in target.capability("electronics").servos}
    low, _ = target.map.window_rad.T
    return bool(np.all(np.abs(plant.angles() - low) < 0.15)) and torques == {QUIET.limp_units}


def provoke(spoil):
    """Spoil a hand in use; return what the watch said, and whether the hand was left open and limp."""
    with open_target(guard=QUIET) as target:
        hold(target, [20000] * 7, 1.0)
        spoil(target)
        with pytest.raises(SafetyAbortError) as caught:
            hold(target, [20000] * 7, 2.0)
        return str(caught.value), is_open_and_limp(target)


def test_a_hot_servo_stops_everything():
    message, safe = provoke(lambda target: heat(5, 66.0)(target.capability("electronics")))
    assert "ring is at" in message
    assert safe


def test_too_much_current_for_too_long_stops_everything():
    def blocked(target):
        hold(target, [20000, 20000, 20000, 20000, 0, 65535, 0], 3.0)

    with open_target(guard=SafetyLimits(torque_units=700)) as target:
        with pytest.raises(SafetyAbortError, match="thumb_cmc_flexion has drawn 4"):
            blocked(target)
        assert is_open_and_limp(target)


def test_the_default_torque_limit_keeps_a_blocked_channel_below_the_abort():
    with open_target(guard=QUIET) as target:
        hold(target, [0, 0, 0, 0, 0, 65535, 0], 1.5)
        assert 3.0 < np.abs(target.hand.read_currents()).max() < QUIET.current_a


def test_telemetry_that_stands_still_stops_everything():
    """The servo that does not answer cannot be opened either; the others are."""
    message, _ = provoke(lambda target: rename(4, 9)(target.capability("electronics")))
    assert "telemetry has stood still" in message


def test_an_encoder_that_jumps_stops_everything():
    def slip(target):
        turned = servo(target, Channel.MIDDLE)
        turned.frame.set_offset(900)
        turned._feedback.invalidate()

    message, _ = provoke(slip)  # with a wrong encoder, open is not where it was
    assert "middle encoder jumped" in message


def test_motion_without_a_command_stops_everything():
    """Somebody opens the hand with another program."""

    def meddle(target):
        hold(target, [20000] * 7, QUIET.settle_s + 0.2)
        electronics = target.capability("electronics")
        electronics.receive(bytes([0x11, 0]) + bytes(14))
        target.clock.sleep_until(target.clock.now() + 0.5)

    with open_target(guard=QUIET) as target:
        hold(target, [20000] * 7, 1.0)
        meddle(target)
        with pytest.raises(SafetyAbortError, match="without a command"):
            hold(target, [20000] * 7, 1.0)


@pytest.mark.parametrize("error", [KeyboardInterrupt, RuntimeError])
def test_an_interrupt_or_a_crash_leaves_the_hand_open_and_limp(error):
    seen = []

    def use():
        with open_target(guard=QUIET) as target:
            seen.append(target)
            hold(target, [40000] * 7, 1.0)
            raise error

    with pytest.raises(error):
        use()
    assert is_open_and_limp(seen[0])


def test_an_abort_in_an_experiment_ends_the_run_in_words():
    with open_target(guard=QUIET) as target:
        heat(5, 64.0)(target.capability("electronics"))
        target.hand.limits = SafetyLimits(temperature_c=30.0)
        target.hand._monitor = SafetyMonitor(target.hand.limits, SPANS)
        result = validate(target, ["audit"])
    assert "stopped and opened the hand" in result.stopped.meaning


def test_the_report_names_the_thresholds():
    with open_target(guard=QUIET) as target:
        html = render_report(validate(target, ["presence"]))
    assert "current_a 4, current_s 0.3, temperature_c 65, stale_s 0.2" in html


def test_a_hand_that_was_never_moved_is_not_moved_at_the_end():
    with open_target(guard=QUIET) as target:
        target.hand.read_codes()
    sent = [record.data[0] for record in target.wire.since(0, 0.0) if record.direction == "to_hand"]
    assert 0x11 not in sent
    assert 0x32 not in sent


def test_the_first_motions_are_slow():
    speeds = []
    with open_target(guard=QUIET) as target:
        for wait in (0.0, QUIET.gentle_s + 1.0):
            hold(target, [0] * 7, wait + 0.5)
            target.hand.command_codes([40000] * 4 + [0] * 3)
            target.clock.sleep_until(target.clock.now() + 0.15)
            speeds.append(np.abs(target.hand.read_speeds()[:4]).max())
    gentle = QUIET.gentle_units * 50 * 2 * np.pi / 4096
    assert speeds[0] == pytest.approx(gentle, rel=0.1)
    assert speeds[1] > 2 * gentle


def test_homing_is_no_motion_without_a_command():
    with open_target(guard=QUIET) as target:
        hold(target, [0] * 7, 0.2)
        target.hand.home()
        hold(target, [20000] * 7, 1.0)
        torques = {s.memory.get(GOAL_TORQUE) for s in target.capability("electronics").servos}
        assert torques == {QUIET.torque_units}


def test_without_torque_settings_the_watch_stops_a_blocked_channel():
    """Firmware `pre` cannot limit its torque, so a blocked channel draws more than the watch allows."""
    with open_target(guard=QUIET, firmware="pre") as target:
        with pytest.raises(SafetyAbortError, match="thumb_cmc_flexion has drawn"):
            hold(target, [0, 0, 0, 0, 0, 65535, 0], 3.0)
        target.clock.sleep_until(target.clock.now() + 1.0)
        assert np.all(target.hand.read_codes() < 2000)


def test_one_program_at_a_time(tmp_path):
    with open_target("pty") as first:
        second = open_target(first.hand.name)
        with pytest.raises(NoHandError, match="another program"), second:
            pytest.fail("the port was given out twice")


def readings(codes=0.2, current=0.5, temperature=40.0, noise=0.0):
    return (
        np.full(7, codes * 65535),
        np.full(7, current) + noise * np.arange(7),
        np.full(7, temperature),
    )


@given(st.integers(0, 6), st.floats(4.0, 7.0), st.booleans(), st.floats(0.0, 1.0))
def test_current_counts_only_when_it_lasts(channel, current, negative, duration):
    monitor = SafetyMonitor(QUIET, SPANS)
    reason, t = None, 0.0
    while reason is None and t <= duration:
        codes, currents, temperatures = readings(noise=t)
        currents = np.clip(currents, 0, 1)
        currents[channel] = -current if negative else current
        reason = monitor.look(t, codes, currents, temperatures)
        t += 0.05
    assert (reason is not None) == (duration >= 0.3)


@given(st.floats(20.0, 90.0))
def test_the_temperature_limit_is_where_it_is_said_to_be(temperature):
    reason = SafetyMonitor(QUIET, SPANS).look(0.0, *readings(temperature=temperature))
    assert (reason is not None) == (temperature >= QUIET.temperature_c)


@given(st.floats(0.01, 0.6))
def test_repeating_readings_count_as_stale_after_their_limit(age):
    monitor = SafetyMonitor(QUIET, SPANS)
    assert monitor.look(0.0, *readings()) is None
    assert (monitor.look(age, *readings()) is not None) == (age > QUIET.stale_s)
