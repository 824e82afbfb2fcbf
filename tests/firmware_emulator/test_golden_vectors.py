"""Byte vectors of the wire, host side and bus side (aero-open-firmware d7bd82e, FTServo_Arduino 64922cd)."""

import pytest

from tests.firmware_emulator.conftest import AT_STOPS, frame, stopped_bench


@pytest.mark.parametrize(
    ("firmware", "request_", "answer"),
    [
        ("0.1.0", "03 00 03 00 9C FF", "03 00 03 00 5D 08"),
        ("0.1.0", "03 00 02 00 0A 00", "03 00 02 00 CC 04"),
        ("0.1.0", "03 00 07 00 0A 00", None),
        ("0.1.0", "31 00 09 00 00 00", "31 00 FF FF 00 00"),
        ("0.1.0", "31 00 03 00 FF FF", "31 00 03 00 FE 7F"),
        ("0.1.0", "32 00 06 00 D0 07", "32 00 06 00 FF 03"),
        ("0.1.0", "02 00 03 00 FF 03", "02 00 FF FF FF FF FF FF FF FF"),
        ("0.1.0", "02 00 FE 00 FF 03", "02 00 FF 00 FE 00"),
        ("0.1.0", "02 00 FF 55 FF 03", "02 00 FF 00 FF 00"),
        ("0.1.0", "21", None),
        ("pre", "31 00 03 00 FF FF", None),
    ],
)
def test_host_vectors(make_host, firmware, request_, answer):
    host = make_host(firmware=firmware)
    host.link.write(frame(request_))
    assert host.link.read(17, 0.2) == (b"" if answer is None else frame(answer))


def test_set_id_of_the_one_servo_on_the_bus(make_host, bus_log):
    host = make_host(firmware="0.1.0")
    host.hand.bus.servos = host.hand.bus.servos[1:2]
    bus_log.clear()
    host.link.write(frame("02 00 03 00 FF 03"))
    assert host.link.read(16, 5.0) == frame("02 00 01 00 03 00 FF 03")
    assert host.hand.bus.servos[0].id == 3
    writes = [data for _, data in bus_log if data[4] not in {0x01, 0x82}]
    assert writes == [
        bytes.fromhex(text)
        for text in (
            "FF FF 01 04 03 28 00 CF",
            "FF FF 01 04 03 37 00 C0",
            "FF FF 01 05 03 1C FF 03 D8",
            "FF FF 01 04 03 05 03 EF",
            "FF FF 03 04 03 37 01 BD",
            "FF FF 03 04 02 1C 02 D8",
        )
    ]


def test_set_id_caps_the_limit_and_takes_any_id(make_host):
    host = make_host(firmware="0.1.0")
    host.hand.bus.servos = host.hand.bus.servos[:1]
    host.link.write(frame("02 00 FD 12 FF FF"))
    assert host.link.read(16, 5.0) == frame("02 00 00 00 FD 00 FF 03")


def test_set_id_finds_the_new_id_taken_after_the_scan(make_host):
    """A servo that is plugged in when the scan has passed its ID answers the second ping."""
    host = make_host(firmware="0.1.0")
    late = host.hand.bus.servos[3]
    host.hand.bus.servos = host.hand.bus.servos[5:6]
    host.hand.kernel.call_at(host.hand.clock.now() + 1.0, host.hand.bus.servos.append, late)
    assert host.ask(0x02, 3, 1023, timeout=5.0) == frame("02 00 05 00 03 00")


def test_set_id_without_a_servo_scans_all_ids_in_vain(make_host):
    host = make_host(firmware="0.1.0")
    host.hand.bus.servos.clear()
    start = host.hand.clock.now()
    assert host.ask(0x02, 3, 1023, timeout=5.0) == frame("02 00 FF 00 03 00")
    assert 2.6 <= host.hand.clock.now() - start <= 2.8


def test_sync_read_of_the_telemetry(make_host, bus_log):
    make_host(firmware="0.1.0").wait(0.02)
    assert bus_log[-1][1] == bytes.fromhex("FF FF FE 0B 82 38 0F 00 01 02 03 04 05 06 18")


def test_sync_write_of_a_command(make_host, bus_log):
    host = make_host(firmware="0.1.0")
    bus_log.clear()
    host.send(0x11)
    host.wait(0.005)
    assert bus_log[0][1] == bytes.fromhex(
        "FF FF FE 3C 83 29 07 00 00 00 08 FF 03 FE 7F 01 00 9F 0C FF 03 FE 7F 02 00 5B 04 FF 03 FE 7F 03 00 CE 0C FF 03"
        "FE 7F 04 00 CE 0C FF 03 FE 7F 05 00 CE 0C FF 03 FE 7F 06 00 CE 0C FF 03 FE 7F 0A"
    )


def test_switch_to_torque_mode_and_back(make_host, bus_log):
    host = make_host(firmware="0.1.0")
    bus_log.clear()
    host.send(0x12, *[1000] * 7)
    host.send(0x11)
    host.wait(0.02)
    written = [data for _, data in bus_log if data[4] == 0x03]
    assert len(written) == 21
    assert written[0] == bytes.fromhex("FF FF 00 04 03 21 02 D5")
    assert written[10] == bytes.fromhex("FF FF 03 05 03 2C E8 03 DD")
    assert written[14] == bytes.fromhex("FF FF 00 04 03 21 00 D7")


def test_negative_torque(make_host, bus_log):
    host = make_host(firmware="0.1.0", hand="left")
    host.send(0x12, 1000)
    host.wait(0.01)
    assert bytes.fromhex("FF FF 00 05 03 2C E8 83 60") in [data for _, data in bus_log]


def test_homing_of_a_right_hand(make_host, bus_log):
    # Every shaft starts at its stop, so that nothing has to be searched for long.
    host = make_host(plant=stopped_bench(AT_STOPS), firmware="0.1.0", start="reset")
    assert host.link.read(241, 1.0)
    bus_log.clear()
    host.link.write(frame("01"))
    assert host.link.read(16, 100.0) == frame("01")
    sent = [data for _, data in bus_log]
    for text in (
        "FF FF 00 0A 03 29 0A B0 3C EE 02 0A 00 D9",
        "FF FF 01 0A 03 29 0A B0 BC B6 03 0A 00 8F",
        "FF FF 02 0A 03 29 0A B0 3C B6 03 0A 00 0E",
        "FF FF 03 0A 03 29 0A B0 BC B6 03 0A 00 8D",
        "FF FF 00 04 02 38 0F B2",
        "FF FF 00 04 02 45 02 B2",
        "FF FF 00 04 02 38 02 BF",
        "FF FF 03 0A 03 29 00 CE 0C FF 03 60 09 81",
    ):
        assert bytes.fromhex(text) in sent
    at = sent.index(bytes.fromhex("FF FF 00 02 0B F2"))
    torque_off, unlock = bytes.fromhex("FF FF 00 04 03 28 00 D0"), bytes.fromhex("FF FF 00 04 03 37 00 C1")
    assert sent[at - 3 : at] == [torque_off, torque_off, unlock]
