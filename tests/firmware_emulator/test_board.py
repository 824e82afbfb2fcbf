from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

GETS = (0x22, 0x23, 0x24, 0x25)


@given(st.binary(max_size=40))
def test_stray_bytes_shift_every_later_frame_until_they_add_up_to_sixteen(make_host, stray):
    # Bytes that are no opcode at any shifted position, so that nothing is executed by accident.
    stray = bytes(byte & 0x0F | 0xA0 for byte in stray)
    host = make_host()
    host.link.write(stray)
    answer = host.ask(0x22)
    assert bool(answer) == (len(stray) % 16 == 0)
    host.link.write(bytes(-len(stray) % 16))
    host.link.read(64, 0.01)
    assert len(host.ask(0x22)) == 16


def test_gets_are_zero_before_the_first_telemetry_and_fresh_after_it(make_host):
    host = make_host(firmware="0.1.0", start="reset")
    assert host.link.read(241, 0.5).endswith(b"Servo 6 dir=1\n")
    assert host.words(0x25) == (0,) * 7
    host.wait(0.02)
    assert host.words(0x25) == (34,) * 7


@pytest.mark.parametrize(("firmware", "period"), [("0.2.0", 0.01), ("pre", 0.02)])
def test_readings_age_by_the_telemetry_period(make_host, firmware, period):
    host = make_host(firmware=firmware)
    host.send(0x11, *[40000] * 7)
    seen = []
    for _ in range(200):
        seen.append((host.hand.clock.now(), host.words(0x22)[3]))
        host.wait(0.0008)
    changes = [t for (_, before), (t, after) in pairwise(seen) if after != before]
    gaps = [b - a for a, b in pairwise(changes)]
    assert len(gaps) > 3
    assert min(gaps) == pytest.approx(period, abs=0.0025)


@pytest.mark.parametrize("hand", ["right", "left"])
def test_a_commanded_posture_is_reached_within_friction_and_reads_below_the_command(make_host, hand):
    host = make_host(side=hand, firmware="0.1.0")
    commands = (10000, 20000, 30000, 40000, 50000, 60000, 1000)
    host.send(0x11, *commands)
    host.wait(1.5)
    for command, reading, span in zip(commands, host.words(0x22), (1138, 1183, 2980, *[3278] * 4), strict=True):
        assert abs(command - reading) * span / 65535 <= 6
    assert host.words(0x23, signed=True) == (0,) * 7


def test_speed_and_torque_settings_reach_the_motion(make_host):
    slow, fast = make_host(), make_host()
    for channel in range(7):
        assert slow.ask(0x31, channel, 20)
    travelled = {}
    for host in (slow, fast):
        host.send(0x11, *[60000] * 7)
        host.wait(0.2)
        before = host.words(0x22)[3]
        host.wait(0.1 - 0.0002)
        travelled[host] = (host.words(0x22)[3] - before) * 3278 / 65535
    # 20 units are 1000 counts/s.
    assert travelled[slow] == pytest.approx(100, abs=2)
    assert travelled[fast] > 500
    weak = make_host()
    for channel in range(7):
        assert weak.ask(0x32, channel, 100)
    weak.send(0x11, *[60000] * 7)
    weak.wait(0.15)
    assert max(map(abs, weak.words(0x24, signed=True))) <= 100


@given(seed=st.integers(0, 2**32), script=st.lists(st.tuples(st.integers(0, 65535), st.floats(0, 0.05)), max_size=8))
def test_the_same_seed_and_calls_give_the_same_wire_log(make_host, seed, script):
    logs = []
    for _ in range(2):
        host = make_host(seed=seed)
        for word, pause in script:
            host.send(0x11, *[word] * 7)
            for opcode in GETS:
                host.ask(opcode)
            host.wait(pause)
        logs.append(host.link.log)
    assert logs[0] == logs[1]
