"""What the real firmware does with damaged answers of its servos, which no recorded session has."""

from tests.firmware_emulator.conftest import AT_STOPS, stopped_bench

TRAIN, WORD = 147, 8
"""Bytes of the answers of all servos to a telemetry request, and of one servo to a read of two bytes."""


class Wire:
    """A tap that keeps what the board asks, and lets answers arrive as `damage` makes them."""

    def __init__(self, host, damage):
        self.asked_for, self.answered = [], damage
        self.asked = self.asked_for.append
        host.hand.bus.tap = self


def test_stray_bytes_in_front_of_a_train_cost_the_cycle(make_host):
    host = make_host(firmware="0.2.0")
    before = host.words(0x22)
    host.send(0x11, *[40000] * 7)
    Wire(host, lambda data: b"\0" + data if len(data) == TRAIN else data)
    host.wait(0.3)
    assert host.words(0x22) == before


def test_a_train_cut_within_its_last_answer_is_completed_by_what_came_before(make_host):
    host = make_host(firmware="0.2.0")
    host.wait(0.1)
    for servo in host.hand.servos:
        servo.heat_to(60.5)
    Wire(host, lambda data: data[:131] if len(data) == TRAIN else data)
    host.wait(0.05)
    # Of the last answer came the header, the ID, the length and the error byte; the rest is of the train before.
    assert host.words(0x25) == (*(60,) * 6, 34)


def test_a_limit_that_cannot_be_read_is_left_alone(make_host):
    host = make_host(plant=stopped_bench(AT_STOPS), firmware="0.2.0", start="power_on")
    wire = Wire(host, lambda data: b"" if len(data) == WORD and data[2] == 4 and wire.asked_for[-1][5] == 28 else data)
    host.wait(6.0)
    at = next(i for i, data in enumerate(wire.asked_for) if data[2] == 4 and data[4:6] == bytes((2, 28)))
    assert (wire.asked_for[at + 1][2], wire.asked_for[at + 1][4]) == (5, 1)
    assert host.hand.servos[4].memory.get("torque_enable") == 1
