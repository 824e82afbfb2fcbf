"""What a person does to a running hand: faults come and go, go along with their part, and are gone with it."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from aero import Channel
from aero.channels import WIRE_ORDER
from hil.emulated.any_hand import open_target
from hil.emulated.faults import CATALOGUE, parse_fault
from hil.emulated.faults.acts import ACTS
from hil.emulated.faults.bench import next_act
from hil.recordings.recorder import Recorder
from hil.verdict.part import Part

RING, PINKY = Channel.RING, Channel.PINKY
HOMES_S = 60.0
CLOSED = np.array([45000] * 4 + [0, 30000, 30000])


def closed(target, level=1.0, seconds=1.2):
    """Close the hand, and return true joint angles (16,) and readings (7,)."""
    target.hand.command_codes((level * CLOSED).astype(int))
    target.clock.sleep_until(target.clock.now() + seconds)
    return target.truth.plant.joint_angles(), target.hand.read_codes().astype(float)


@pytest.fixture
def target():
    with open_target(seed=3) as opened:
        yield opened


def test_a_dead_motor_in_the_middle_of_a_run_does_not_follow_until_it_is_mended(target):
    before = closed(target)[1]
    closed(target, 0.0)
    target.inject("motor_dead:ring")
    dead = closed(target)[1]
    target.clear("motor_dead:ring")
    mended = closed(target)[1]
    assert dead[RING] < 0.5 * before[RING]
    np.testing.assert_allclose(np.delete(dead, RING), np.delete(before, RING), atol=800)
    np.testing.assert_allclose(mended, before, atol=800)


LASTING = [fault for fault in CATALOGUE.values() if fault.later and not fault.at_s]


@given(st.lists(st.sampled_from(LASTING), min_size=1, max_size=4, unique_by=lambda fault: fault.excludes or fault.name))
@settings(max_examples=25, deadline=None)
def test_a_hand_whose_faults_are_cleared_is_as_it_was(faults):
    with open_target(seed=3) as target:
        bench = target.bench.workbench
        before = (
            bench.assembly.unit,
            bench.assembly.shafts,
            [servo.memory.get("id") for servo in bench.electronics.servos],
        )
        for fault in faults:
            target.inject(fault.at())
        assert len(bench.present) == len(faults)
        for fault in faults:
            if fault.name != "nvs_lost":  # it has happened
                target.clear(fault.at())
        after = (
            bench.assembly.unit,
            bench.assembly.shafts,
            [servo.memory.get("id") for servo in bench.electronics.servos],
        )
        assert after == before
        assert bench.assembly.link.is_idle


def test_what_is_wrong_with_a_servo_goes_along_with_it_and_what_is_wrong_with_a_digit_stays(target):
    for fault in ("motor_weak:ring=0.5", "gear_friction:ring", "protection_low:ring", "stiff_joint:ring"):
        target.inject(fault)
    target.act("exchange_servos ring pinky")
    where = {fault.name: fault.channel for fault in target.bench.workbench.present}
    assert where == {"motor_weak": PINKY, "gear_friction": PINKY, "protection_low": PINKY, "stiff_joint": RING}
    low = [servo.memory.get("protection_current") for servo in target.truth.electronics.servos]
    assert np.argmin(low) == WIRE_ORDER.index(PINKY)


def test_an_exchanged_servo_takes_its_heat_along(target):
    """The place of a servo that had run away stayed hot, and so the fault seemed to stay with the good digit."""
    ring, pinky = (target.truth.electronics.servos[WIRE_ORDER.index(one)] for one in (RING, PINKY))
    ring.heat_to(61.0)
    usual = pinky.feedback.temperature_c
    target.act("exchange_servos ring pinky")
    assert (ring.feedback.temperature_c, pinky.feedback.temperature_c) == (usual, 61.0)


def test_a_fault_that_heats_a_servo_heats_it_in_its_new_place(target):
    ring, pinky = (target.truth.electronics.servos[WIRE_ORDER.index(one)] for one in (RING, PINKY))
    target.inject("servo_hot:ring=78")
    target.act("exchange_servos ring pinky")
    assert pinky.feedback.temperature_c == pytest.approx(78.0)
    assert ring.feedback.temperature_c < 50.0


@pytest.mark.parametrize("channel", Channel)
def test_a_servo_without_its_cable_turns_and_its_digit_stays(channel, target):
    target.act(f"cable_off {channel.label}")
    joints, readings = closed(target)
    assert readings[channel] == pytest.approx(CLOSED[channel], abs=1500)
    if channel in (RING, PINKY):
        assert np.abs(joints[3 * channel : 3 * channel + 3]).max() < 0.15
    target.act(f"cable_on {channel.label}")
    closed(target, 0.0)
    assert np.abs(closed(target)[0]).max() > 0.3


def test_a_hand_that_holds_something_closes_less_and_lets_it_go(target):
    free = closed(target)[0]
    target.act("hold")
    held = closed(target)[0]
    target.act("let_go")
    assert held[0] < 0.8 * free[0]
    assert closed(target)[0][0] == pytest.approx(free[0], abs=0.1)


def test_a_hand_that_was_homed_by_hand_goes_on_working(target):
    before = closed(target)[1]
    closed(target, 0.0)
    target.act("home")
    target.clock.sleep_until(target.clock.now() + HOMES_S)
    np.testing.assert_allclose(closed(target)[1], before, atol=3000)


@pytest.mark.parametrize("part", Part)
def test_with_its_part_a_fault_is_gone(part):
    faults = [fault.at() for fault in LASTING if fault.part is part]
    rivals = {fault.rivals: fault for fault in faults}.values()
    with open_target(seed=3) as target:
        for fault in rivals:
            target.inject(fault)
        target.act(f"replace {part.name.lower()}")
        assert target.bench.workbench.present == ()


@pytest.mark.parametrize("channel", [Channel.RING, Channel.THUMB_FLEXOR])
def test_a_person_feels_a_jammed_digit_and_a_cable_off_its_spool_and_no_dead_motor(channel, target):
    target.inject(f"motor_dead:{channel.label}")
    assert "nothing differs" in target.act(f"feel {channel.label}")
    target.act(f"cable_off {channel.label}")
    assert "it is loose" in target.act(f"feel {channel.label}")
    target.act(f"cable_on {channel.label}")
    target.inject(f"digit_jammed:{channel.label}")
    assert "more resistance" in target.act(f"feel {channel.label}")


def test_a_meter_shows_a_weak_supply_and_none_when_it_is_off(target):
    volts = target.bench.workbench.volts()
    target.inject("supply_low=0.4")
    assert target.bench.workbench.volts() == pytest.approx(0.6 * volts, rel=0.05)
    target.act("power_off")
    assert target.act("voltage").startswith("measured 0.00 V at the plug; the supply gives ")
    target.act("power_on")
    target.clear("supply_low=0.4")
    target.clock.sleep_until(target.clock.now() + 8.0)
    target.hand.resynchronise()
    assert target.bench.workbench.volts() == pytest.approx(volts, rel=0.05)


def test_a_supply_that_is_switched_off_and_on_beside_usb_restarts_no_board_and_homes_nothing(target):
    """As an owner reports: with the servo supply cut and USB plugged in the ESP32 does not restart."""
    closed(target)
    board = target.bench.workbench.electronics.board
    target.act("supply_off")
    assert target.act("voltage").startswith("measured 0.00 V")
    target.clock.sleep_until(target.clock.now() + 1.0)
    assert target.truth.plant.joint_angles()[:12].max() < 0.2  # the springs open it
    target.act("supply_on")
    target.clock.sleep_until(target.clock.now() + 6.0)
    assert target.bench.workbench.electronics.board is board
    assert [servo.memory.get("torque_enable") for servo in target.bench.workbench.electronics.servos] == [0] * 7
    # The spools unwound and the servos lost their turns, so only homing finds the zero again.
    assert closed(target)[0][:12].max() < 0.2
    target.act("home")
    target.clock.sleep_until(target.clock.now() + 8.0)
    target.hand.resynchronise()
    assert closed(target)[0][:12].max() > 0.5


def test_a_recording_holds_what_was_done_and_when(target):
    recorder = Recorder(target, "excursion")
    recorder.begin()
    closed(target, seconds=0.4)
    target.inject("motor_dead:ring")
    closed(target, seconds=0.4)
    target.act("replace servo ring")
    recording = recorder.finish()
    said = [(round(event.t, 2), event.text) for event in recording.events]
    assert (0.4, "injected motor_dead:ring=1.0") in said
    assert "replaced: servo of ring" in [text for _, text in said]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("", "unknown act"),
        ("exchange_servo ring pinky", "did you mean `exchange_servos"),
        ("exchange_servos ring", "usage: exchange_servos CHANNEL CHANNEL"),
        ("feel toe", "unknown channel 'toe'"),
        ("replace wheel", "unknown part 'wheel'"),
        ("cable_on ring", "is on its spool"),
        ("inject winding_reversed", "is built in"),
        ("clear motor_dead", "does not have motor_dead"),
    ],
)
def test_what_cannot_be_done_is_said_in_one_line(words, message, target):
    with pytest.raises(ValueError, match=message) as refused:
        target.act(words)
    assert "\n" not in str(refused.value)


def test_what_has_happened_cannot_be_undone(target):
    target.inject("board_restart")
    with pytest.raises(ValueError, match="cannot be undone"):
        target.clear("board_restart")
    assert target.bench.state().acts == ()


def test_every_act_is_said_for_people():
    assert all(one.words for one in ACTS.values())


def test_a_hand_behind_a_pseudo_terminal_is_broken_too():
    with open_target("pty", seed=1) as target:
        target.inject("motor_dead:ring")
        assert [str(fault) for fault in target.wrong] == ["motor_dead:ring=1.0"]
        with pytest.raises(ValueError, match="program's end of the link"):
            target.inject("host_stalls")
        with pytest.raises(ValueError, match="unknown act 'break'"):
            target.act("break it")
        assert target.act("cable_off index") == "took the cable of index off its spool"
        target.bench.restore(())
        assert target.wrong == ()
        assert [text.split()[0] for _, text in target.bench.state().done] == [
            "injected",
            "took",
            "put",
            "cleared",
        ]


LINES = st.lists(
    st.sampled_from(
        ["inject motor_dead:ring=1.0", "inject encoder_noise:index=3.0", "cable_off middle", "hold", "power_off",
         "supply_off",
         "exchange_servos ring pinky", "exchange_plugs index middle"]
    ),
    unique=True,
    max_size=5,
)  # fmt: skip
OPPOSITES = {
    "clear": "inject",
    "cable_on": "cable_off",
    "let_go": "hold",
    "power_on": "power_off",
    "supply_on": "supply_off",
}


@given(LINES, LINES)
def test_a_hand_is_brought_from_any_state_into_any_other(present, wanted):
    exchanges = [one for one in present if one.startswith("exchange")]
    others = [one for one in present if one not in exchanges]
    for _ in range(20):
        if (words := next_act((*exchanges, *others), wanted)) is None:
            break
        name, _, rest = words.partition(" ")
        if name in OPPOSITES:
            others.remove(f"{OPPOSITES[name]} {rest}".strip())
        elif not name.startswith("exchange"):
            others.append(words)
        elif exchanges[-1:] == [words]:
            exchanges.pop()
        else:
            exchanges.append(words)
    assert exchanges == [one for one in wanted if one.startswith("exchange")]
    assert set(others) == set(wanted) - set(exchanges)


@pytest.mark.parametrize(
    "act",
    ["inject motor_dead:ring", "cable_off index", "hold", "power_off", "supply_off", "exchange_servos ring pinky"],
)
def test_every_act_is_undone(target, act):
    target.inject("motor_weak:pinky")
    before = target.bench.state().acts
    target.act(act)
    assert target.bench.state().acts != before
    target.bench.restore(before)
    assert target.bench.state().acts == before


@pytest.mark.parametrize(
    ("fault", "act", "shown"),
    [
        (None, "feel ring", "bent ring: nothing differs"),
        (None, "look ring", "looked at ring: nothing differs"),
        (None, "registers", "read the bus: nothing differs"),
        ("digit_jammed:ring", "feel ring", "bent ring: it bends with more resistance"),
        ("digit_jammed:ring", "feel pinky", "bent pinky: nothing differs"),
        ("spring_off:index=1", "feel index", "bent index: it springs back otherwise"),
        ("cable_snapped:middle", "look middle", "looked at middle: its cable is slack"),
        ("cable_snapped:middle", "feel middle", "bent middle: it is loose, as without its cable"),
        ("winding_reversed:ring", "look ring", "looked at ring: its cable lies otherwise on its spool"),
        ("servo_missing:pinky", "registers", "read the bus: ID 6 does not answer"),
        ("servo_id_doubled:ring", "registers", "read the bus: ID 5 does not answer; ID 6 answers twice"),
        ("motor_dead:ring", "feel ring", "bent ring: nothing differs"),
        ("board_runs_0.1.5", "flashed", "flashed: 0.1.5, for a right hand"),
    ],
)
def test_hands_eyes_and_instruments_find_what_they_can(fault, act, shown):
    with open_target(faults=[parse_fault(fault)] if fault else []) as target:
        assert target.act(act) == shown
