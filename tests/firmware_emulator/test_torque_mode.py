import pytest

from tests.firmware_emulator.conftest import stopped_bench

SIGNS = {"right": (1, 1, -1, 1, 1, 1, 1), "left": (-1, -1, 1, -1, -1, -1, -1)}


def goal_torques(host):
    return tuple(servo.memory.get("goal_torque") for servo in host.hand.servos)


def send_torque(host, *words):
    host.send(0x12, *words)
    host.wait(0.02)


@pytest.mark.parametrize("hand", SIGNS)
@pytest.mark.parametrize(("word", "magnitude"), [(300, 300), (1000, 1000), (1001, 1000), (0xFFFF, 1000), (0, 0)])
def test_torque_always_closes_and_is_capped(make_host, hand, word, magnitude):
    host = make_host(firmware="0.1.0", side=hand)
    send_torque(host, *[word] * 7)
    assert goal_torques(host) == tuple(sign * magnitude for sign in SIGNS[hand])
    assert {servo.memory.get("mode") for servo in host.hand.servos} == {2}
    host.wait(0.1)
    angles = host.hand.servos[0]._shafts.sample().angles
    assert all(angle > 0.1 for angle in angles) or magnitude == 0


def test_mode_is_not_sent_again_after_homing(make_host, bus_log):
    """The firmware's flag still says torque: servos stay in position mode with a torque limit of the wrong sign."""
    host = make_host(plant=stopped_bench(), firmware="0.2.0")
    send_torque(host, *[100] * 7)
    assert host.ask(0x01, timeout=20.0)
    send_torque(host, *[200] * 7)
    assert {servo.memory.get("mode") for servo in host.hand.servos} == {0}
    assert goal_torques(host)[2] == -200


def test_the_hot_clamp_acts_on_the_cached_temperature_and_only_when_commanded(make_host):
    for firmware, at, limit in (("0.1.2", 50, 200), ("0.2.0", 70, 500)):
        host = make_host(firmware=firmware)
        host.send(0x11, *[30000] * 7)
        host.wait(1.0)
        for servo in host.hand.servos[:2]:
            servo.heat_to(at + 0.5)
        host.wait(0.02)
        before = goal_torques(host)
        host.wait(0.1)
        assert goal_torques(host) == before
        send_torque(host, *[1000] * 7)
        assert goal_torques(host) == (limit, limit, -1000, 1000, 1000, 1000, 1000)
        host.send(0x11, *[10000] * 7)
        host.wait(0.02)
        assert goal_torques(host) == (limit, limit, 700, 700, 700, 700, 700)


def test_the_soft_limit_weakens_outside_and_restores_inside(make_host):
    host = make_host(firmware="0.1.1")
    send_torque(host, *[800] * 7)
    host.wait(1.0)
    # Nothing stops these shafts, so every channel has run out of its window.
    assert goal_torques(host) == (200, 200, -200, 200, 200, 200, 200)
    send_torque(host, *[800] * 7)
    host.wait(0.1)
    assert goal_torques(host) == (800, 800, -800, 800, 800, 800, 800)
