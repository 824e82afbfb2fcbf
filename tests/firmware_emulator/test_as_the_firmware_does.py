"""What the real firmware does with a damaged answer while it homes, which no recorded session has."""

from tests.firmware_emulator.conftest import AT_STOPS, stopped_bench

WORD = 8
"""Bytes of a servo's answer to a read of two bytes."""


class Wire:
    """A tap that keeps what the board asks, and lets answers arrive as `damage` makes them."""

    def __init__(self, host, damage):
        self.asked_for, self.answered = [], damage
        self.asked = self.asked_for.append
        host.hand.bus.tap = self


def test_a_limit_that_cannot_be_read_is_left_alone(make_host):
    host = make_host(plant=stopped_bench(AT_STOPS), firmware="0.2.0", start="power_on")
    wire = Wire(host, lambda data: b"" if len(data) == WORD and data[2] == 4 and wire.asked_for[-1][5] == 28 else data)
    host.wait(6.0)
    at = next(i for i, data in enumerate(wire.asked_for) if data[2] == 4 and data[4:6] == bytes((2, 28)))
    assert (wire.asked_for[at + 1][2], wire.asked_for[at + 1][4]) == (5, 1)
    assert host.hand.servos[4].memory.get("torque_enable") == 1
