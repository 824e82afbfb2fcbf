import pytest

from tests.firmware_emulator.conftest import AT_STOPS, stopped_bench

PINGS = "\n[Init] Pinging servos...\r\n" + "".join(f"  ID {servo}: OK\r\n" for servo in range(7))
RIGHT = "[BOOT] Hand Type: RIGHT_HAND\r\n"
LEFT = "[BOOT] Hand Type: LEFT_HAND\r\n"
RIGHT_DIRECTIONS = "".join(f"Servo {servo} dir={sign}\n" for servo, sign in enumerate((-1, 1, -1, 1, 1, 1, 1)))
LEFT_DIRECTIONS = "".join(f"Servo {servo} dir={sign}\n" for servo, sign in enumerate((1, -1, 1, -1, -1, -1, -1)))
SKIPPING = b"[BOOT] Non-power reset \xe2\x86\x92 skipping homing\r\n".decode()

AFTER_RESET = {
    ("pre", "right"): PINGS,
    ("0.1.0", "right"): RIGHT + PINGS + RIGHT_DIRECTIONS,
    ("0.1.0", "left"): LEFT + PINGS + LEFT_DIRECTIONS,
    ("0.1.1", "right"): RIGHT + PINGS + RIGHT_DIRECTIONS,
    ("0.1.2", "left"): LEFT + PINGS + LEFT_DIRECTIONS,
    ("0.1.4", "right"): RIGHT + SKIPPING + PINGS + RIGHT_DIRECTIONS,
    ("0.1.5", "left"): LEFT + SKIPPING,
    ("0.2.0", "right"): RIGHT + SKIPPING,
}


@pytest.mark.parametrize(("firmware", "hand"), AFTER_RESET)
def test_text_after_a_reset(make_host, firmware, hand):
    host = make_host(firmware=firmware, hand=hand, start="reset")
    assert host.link.read(1000, 0.5) == AFTER_RESET[firmware, hand].encode()


AUTO = b"[BOOT] Auto Homing\xe2\x80\xa6\r\n".decode()
COMPLETE = "[BOOT] Homing Complete\r\n"
POWERED_ON = b"[BOOT] Power-on detected \xe2\x86\x92 homing\r\n".decode()

AFTER_POWER_ON = {
    ("pre", "left"): PINGS,
    ("0.1.0", "right"): RIGHT + PINGS + RIGHT_DIRECTIONS,
    ("0.1.1", "left"): LEFT + PINGS + LEFT_DIRECTIONS,
    ("0.1.2", "right"): RIGHT + PINGS + RIGHT_DIRECTIONS,
    ("0.1.3", "right"): RIGHT + AUTO + COMPLETE + PINGS + RIGHT_DIRECTIONS,
    ("0.1.3", "left"): LEFT + AUTO + COMPLETE + PINGS + LEFT_DIRECTIONS,
    ("0.1.4", "left"): LEFT + POWERED_ON + PINGS + LEFT_DIRECTIONS,
    ("0.1.5", "right"): RIGHT + POWERED_ON,
    ("0.2.0", "left"): LEFT + POWERED_ON,
}


@pytest.mark.parametrize(("firmware", "hand"), AFTER_POWER_ON)
def test_text_after_power_on(make_host, firmware, hand):
    host = make_host(plant=stopped_bench(AT_STOPS), firmware=firmware, hand=hand, start="power_on")
    assert host.link.read(1000, 5.0) == AFTER_POWER_ON[firmware, hand].encode()


def test_0_1_3_homes_at_every_boot(make_host):
    host = make_host(plant=stopped_bench(AT_STOPS), firmware="0.1.3", start="reset")
    assert host.link.read(1000, 5.0) == AFTER_POWER_ON["0.1.3", "right"].encode()


def test_missing_servos_are_reported_and_cost_the_librarys_timeout(make_host):
    whole, partial = (make_host(firmware="0.1.0", start="reset") for _ in range(2))
    del partial.hand.bus.servos[2:4]
    complete = whole.link.read(241, 0.5)
    text = partial.link.read(241 + 12, 0.5)
    assert len(complete) == 241
    assert text.count(b"NO REPLY\r\n") == 2
    assert b"  ID 2: NO REPLY\r\n" in text
    delay = partial.hand.clock.now() - whole.hand.clock.now()
    assert 0.020 <= delay <= 0.022
