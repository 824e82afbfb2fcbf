"""What the real firmware, run on the emulated bus, was seen to do, and this emulator once did otherwise."""

from itertools import pairwise

import pytest

from firmware_emulator.packets import pack
from tests.firmware_emulator.conftest import AT_STOPS, frame, stopped_bench

SYNC_READ = 0x82
FEEDBACK_READ = (2, 56, 15)
LOW_TORQUE, FULL_TORQUE = 200, 600


class Wire:
    """A tap that keeps what the board asks, and lets answers arrive as `damage` makes them."""

    def __init__(self, host, damage=lambda data: data):
        self.asked_at = []
        self._host = host
        self.damage = damage
        host.hand.bus.tap = self

    def asked(self, data):
        self.asked_at.append((self._host.hand.kernel.now, data))

    def answered(self, data):
        return self.damage(data)

    def times(self, code, servo=None):
        return [t for t, data in self.asked_at if data[4] == code and servo in {None, data[2]}]


def ms(t):
    return round(t * 1000.0, 6)


def torques(wire, servo):
    return [
        int.from_bytes(data[6:8], "little") & 0x7FFF
        for _, data in wire.asked_at
        if data[2] == servo and data[4:6] == bytes((3, 44))
    ]


def test_position_mode_opens_the_latch_of_the_soft_limit(make_host):
    # Nothing stops these shafts: full torque drives them out of their windows, and there they are weakened.
    host = make_host(firmware="0.2.0")
    wire = Wire(host)
    host.send(0x12, *[FULL_TORQUE] * 7)
    while len(torques(wire, 3)) < 2:
        host.wait(0.005)
    assert torques(wire, 3) == [FULL_TORQUE, LOW_TORQUE]
    host.send(0x11, *[65535] * 7)
    host.wait(0.03)
    wire.asked_at.clear()
    host.send(0x12, *[FULL_TORQUE] * 7)
    host.wait(0.05)
    assert torques(wire, 3) == [FULL_TORQUE, LOW_TORQUE]


def test_a_delay_ends_with_a_tick(make_host):
    host = make_host(plant=stopped_bench(AT_STOPS), firmware="0.2.0", start="power_on")
    wire = Wire(host)
    host.wait(1.0)
    # The pause of 30 ms behind the contact began within a millisecond and ends on a whole one.
    first = [t for t, data in wire.asked_at if data[2] == 0]
    pauses = [(a, b) for a, b in pairwise(first) if b - a > 0.02]
    assert pauses
    for began, ended in pauses:
        assert ms(ended) == pytest.approx(round(ms(ended)), abs=1e-6)
        assert (ended - began) * 1000.0 < round(ms(ended) - ms(began)) + 1


def test_the_soft_limit_looks_at_all_channels_under_one_lock(make_host):
    host = make_host(firmware="0.2.0")
    host.send(0x12, *[10] * 7)
    host.wait(0.1)
    wire = Wire(host)
    host.wait(0.2)
    asked = [(t, data[2], data[4]) for t, data in wire.asked_at]
    looks = [at for at, (_, servo, code) in enumerate(asked) if servo == 0 and code == 2]
    assert len(looks) == 10
    for at in looks:
        assert [servo for _, servo, _ in asked[at : at + 7]] == list(range(7))
    assert {round((asked[b][0] - asked[a][0]) * 1000) for a, b in pairwise(looks)} == {20}


def test_the_soft_limits_grid_runs_in_position_mode_too(make_host):
    # Torque mode begins somewhere between two looks: the next one is where it would have been without it.
    phases = set()
    for wait in (0.001, 0.007, 0.013):
        host = make_host(firmware="0.2.0")
        wire = Wire(host)
        host.wait(wait)
        host.send(0x12, *[10] * 7)
        host.wait(0.06)
        phases.add(round(wire.times(2)[-7] * 1000) % 20)
    assert len(phases) == 1


def test_the_fingers_are_all_pushed_before_any_is_read(make_host):
    host = make_host(plant=stopped_bench(), firmware="0.1.3", start="power_on")
    wire = Wire(host)
    host.wait(3.0)
    search = pack(3, 3, bytes.fromhex("29 00 b0 bc b6 03 60 09"))
    at = next(index for index, (_, data) in enumerate(wire.asked_at) if data == search)
    assert [(data[2], data[4]) for _, data in wire.asked_at[at : at + 6]] == [
        (3, 3),
        (4, 3),
        (5, 3),
        (6, 3),
        (3, 2),
        (3, 2),
    ]


def test_a_tick_passes_between_contact_and_hold(make_host):
    host = make_host(plant=stopped_bench(AT_STOPS), firmware="0.2.0", start="power_on")
    wire = Wire(host)
    host.wait(1.0)
    hold = next(
        t for t, data in wire.asked_at if data[2] == 0 and data[4:7] == bytes((3, 41, 0)) and data[9:11] == b"\xe8\x03"
    )
    assert ms(hold) == pytest.approx(round(ms(hold)), abs=1e-6)


def test_telemetry_begins_with_the_loop_and_keeps_to_the_ticks(make_host):
    host = make_host(firmware="0.2.0", start="reset")
    wire = Wire(host)
    host.wait(0.2)
    assert [ms(t) for t in wire.times(SYNC_READ)[:3]] == [100.0, 110.0, 120.0]


def test_telemetry_after_a_boot_that_ends_between_ticks(make_host):
    host = make_host(firmware="0.1.0", start="reset")
    wire = Wire(host)
    host.wait(0.2)
    first, second, third = [ms(t) for t in wire.times(SYNC_READ)[:3]]
    assert first != round(first)
    assert (second, third) == (int(first) + 10, int(first) + 20)


def test_the_earliest_firmware_pings_150_ms_after_its_reset(make_host):
    host = make_host(firmware="pre", start="reset")
    wire = Wire(host)
    host.wait(0.5)
    assert [ms(t) for t in wire.times(1)[:2]] == [150.0, 170.0]
    assert ms(wire.times(SYNC_READ)[0]) == 290.0


WRONG_SERVO = bytes.fromhex("ff ff 05 00 de 06 12")


def test_an_answer_of_another_servo_is_refused_at_once(make_host):
    host = make_host(firmware="0.2.0")
    host.wait(0.0)
    wire = Wire(host, lambda data: WRONG_SERVO if len(data) == 8 else data)
    host.send(0x12, *[10] * 7)
    host.wait(0.045)
    looks = [t for t, data in wire.asked_at if data[4] == 2]
    assert looks[1] - looks[0] < 0.001


@pytest.fixture
def told(make_host):
    """What GET_POS says before and after the position changed and one telemetry answer in that time was damaged."""

    def tell(damage):
        host = make_host(firmware="0.2.0")
        before = host.words(0x22)
        host.send(0x11, *[40000] * 7)
        trains = []

        def damaged(data):
            trains.append(data)
            return damage(data) if len(data) == 147 else data

        Wire(host, damaged)
        host.wait(0.3)
        return before, host.words(0x22)

    return tell


def test_stray_bytes_in_front_of_a_train_cost_the_cycle(told):
    before, after = told(lambda data: b"\0" + data)
    assert after == before


def test_a_train_cut_within_its_last_answer_is_completed_by_what_came_before(make_host):
    host = make_host(firmware="0.2.0")
    host.wait(0.1)
    for servo in host.hand.servos:
        servo.heat_to(60.5)
    Wire(host, lambda data: data[:131] if len(data) == 147 else data)
    host.wait(0.05)
    # Of the last answer came the header, the ID, the length and the error byte; the rest is of the train before.
    assert host.words(0x25) == (*(60,) * 6, 34)


@pytest.mark.parametrize(("firmware", "homes"), [("0.1.2", False), ("0.1.3", True), ("0.1.4", True), ("0.2.0", True)])
def test_a_brown_out_homes_like_power_on_and_leaves_the_servos_their_power(make_host, firmware, homes):
    host = make_host(plant=stopped_bench(AT_STOPS), firmware=firmware)
    host.send(0x11, *[30000] * 7)
    host.wait(0.5)
    wire = Wire(host)
    speed = host.hand.servos[3].memory.get("goal_speed")
    host.hand.reset("brown_out")
    host.wait(0.05)
    assert host.hand.servos[3].memory.get("goal_speed") == speed
    host.wait(5.0)
    assert bool(wire.times(0x0B)) is homes
    text = host.link.read(1000, 0.0)
    assert (b"Power-on detected" in text) is (firmware in {"0.1.4", "0.2.0"})


@pytest.mark.parametrize(("firmware", "pause_ms"), [("pre", 10), ("0.1.0", 0)])
def test_set_id_waits_behind_limit_id_and_lock(make_host, firmware, pause_ms):
    host = make_host(firmware=firmware)
    host.hand.bus.servos = host.hand.bus.servos[:1]
    wire = Wire(host)
    assert host.ask(0x02, 3, 1023, timeout=5.0) == frame("02 00 00 00 03 00 FF 03")
    unlock, limit, number, lock = [t for t, data in wire.asked_at if data[4] == 0x03][1:]
    read = wire.times(2)[-1]
    assert limit - unlock < 0.001
    assert [number - limit > 0.009, lock - number > 0.009, read - lock > 0.009] == [pause_ms > 0] * 3


def test_a_limit_that_cannot_be_read_is_left_alone(make_host):
    host = make_host(plant=stopped_bench(AT_STOPS), firmware="0.2.0", start="power_on")
    wire = Wire(host, lambda data: b"" if len(data) == 8 and data[2] == 4 and wire.asked_at[-1][1][5] == 28 else data)
    host.wait(6.0)
    asked = [data for _, data in wire.asked_at]
    at = next(index for index, data in enumerate(asked) if data[2] == 4 and data[4:6] == bytes((2, 28)))
    assert (asked[at + 1][2], asked[at + 1][4]) == (5, 1)
    assert host.hand.servos[4].memory.get("torque_enable") == 1
