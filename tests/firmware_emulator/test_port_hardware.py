"""The board's port as hardware: modem lines, resets, a port that goes away, and what a pseudo-terminal cannot carry."""

import socket
import threading
import time
from contextlib import contextmanager, suppress
from urllib.parse import urlsplit

import pytest
import serial
from esptool.reset import HardReset, USBJTAGSerialReset
from hypothesis import given
from hypothesis import strategies as st

from aero import AeroHand, open_hand
from aero.safety import Thresholds
from firmware_emulator.bench import Bench
from firmware_emulator.firmware.setup_and_loop import rom_text
from firmware_emulator.hand import EmulatedHand
from firmware_emulator.links.network import ModemLines
from firmware_emulator.links.pty import PtyServer

# Of pyserial 3.5, which calls it for `rfc2217://`.
pytestmark = pytest.mark.filterwarnings("ignore:set(Daemon|Name):DeprecationWarning")
GET_TEMP = bytes.fromhex("25").ljust(16, b"\0")
PATIENCE_S = 20.0
ROM, WAITING, SKIPPING = b"ESP-ROM:esp32s3", b"waiting for download", b"skipping homing"


@contextmanager
def served(hand=None, **how):
    """A hand served in another thread; its calls are made between two turns of the server's loop."""
    hand = hand or EmulatedHand(Bench())
    hand.says_rom_text = True
    server, done = PtyServer(hand, **how), threading.Event()
    thread = threading.Thread(target=server.run, args=(done.is_set,))
    thread.start()
    try:
        yield server
    finally:
        done.set()
        thread.join(PATIENCE_S)
        server.close()


def heard(port, wanted):
    """What comes until it holds all that is wanted."""
    text, deadline = b"", time.monotonic() + PATIENCE_S
    while not all(part in text for part in wanted) and time.monotonic() < deadline:
        text += port.read(4096)
    assert all(part in text for part in wanted), text
    return text


def answers(port):
    port.write(GET_TEMP)
    return port.read(16)[:2] == GET_TEMP[:2]


@given(st.lists(st.tuples(st.sampled_from(["dtr", "rts"]), st.booleans()), max_size=12))
def test_only_raised_rts_with_dropped_dtr_restarts_the_chip(changes):
    """ESP32-S3 technical reference manual: DTR 0 and RTS 1 is the one state that resets."""
    lines, state = ModemLines(), {"dtr": False, "rts": False}
    for line, value in changes:
        before = dict(state)
        state[line] = value
        assert lines.set(**{line: value}) == (state != before and state == {"dtr": False, "rts": True})


def test_a_client_over_the_network_is_answered_and_may_come_back():
    with served(listen=("localhost", 0)) as server:
        for baud in (921600, 9600):
            with serial.serial_for_url(server.url, baud, timeout=PATIENCE_S) as port:
                assert answers(port)
                assert port.cts


@pytest.mark.parametrize(
    "sent",
    [
        pytest.param(b"\xff\xfa\xff\xf0", id="empty"),
        pytest.param(b"\xff\xfa\x2c\x01\xff\xf0", id="short"),
        pytest.param(b"\xff\xfa\x2c\x05\xfe\xff\xf0", id="unknown"),
        pytest.param(b"\xff\xf0", id="no beginning"),
        pytest.param(b"\xff\xfa" + b"x" * 100_000, id="no end"),
    ],
)
def test_a_client_with_a_wrong_telnet_option_is_dropped_and_the_next_one_is_served(sent):
    with served(listen=("localhost", 0)) as server:
        address = urlsplit(server.url)
        with socket.create_connection((address.hostname, address.port), PATIENCE_S) as client, suppress(OSError):
            client.sendall(sent)
            client.settimeout(0.3)
            while client.recv(4096):
                pass
        with serial.serial_for_url(server.url, timeout=PATIENCE_S) as port:
            assert answers(port)


@pytest.mark.skipif(not socket.has_ipv6, reason="no IPv6 here")
def test_a_board_is_served_over_ipv6():
    with served(listen=("::1", 0)) as server:
        assert server.url.startswith("rfc2217://[::1]:")
        with serial.serial_for_url(server.url, timeout=PATIENCE_S) as port:
            assert answers(port)


def test_a_guarded_program_moves_a_hand_over_the_network():
    """README's `rfc2217://`: second process, driver and guard open it one after the other and together."""
    limits = Thresholds(opening_s=0.3, stale_s=5.0, silent_s=5.0)
    with served(listen=("localhost", 0)) as server:
        for _ in range(2):
            with open_hand(server.url, firmware="0.2.0", thresholds=limits) as hand:
                hand.command_codes([20000] * 7)
                hand.clock.sleep_until(hand.clock.now() + 0.5)
                assert hand.read_codes().min() > 15000
        with AeroHand.open_unguarded(server.url) as hand:
            assert hand.read_codes().max() < 6000
            assert not hand.boot_text


def test_esptools_reset_restarts_the_board_and_plain_opening_does_not():
    with served(listen=("localhost", 0)) as server, serial.serial_for_url(server.url, timeout=PATIENCE_S) as port:
        assert answers(port)
        port.timeout = 0.2
        # As esptool leaves them; with DTR raised its pulse on RTS asks for nothing.
        port.rts = port.dtr = False
        assert port.read(1) == b""
        HardReset(port, uses_usb=True)()
        text = heard(port, (ROM, SKIPPING))
        assert b"USB_UART_CHIP_RESET" in text
        port.timeout = PATIENCE_S
        assert answers(port)


def test_esptools_way_into_the_download_mode_and_out_of_it():
    with served(listen=("localhost", 0)) as server, serial.serial_for_url(server.url, timeout=0.2) as port:
        USBJTAGSerialReset(port)()
        assert SKIPPING not in heard(port, (ROM, WAITING))
        assert not answers(port)
        HardReset(port, uses_usb=True)()
        heard(port, (SKIPPING,))
        port.timeout = PATIENCE_S
        assert answers(port)


def test_a_power_cycle_takes_the_port_away_and_brings_it_back(tmp_path):
    path, hand = tmp_path / "hand", EmulatedHand(Bench(), firmware="0.1.0")
    with served(hand, link=path) as server:
        gone = serial.Serial(server.name, timeout=0.05)
        hand.kernel.call_at(hand.kernel.now, hand.reset, "power_on")
        with pytest.raises(serial.SerialException):  # noqa: PT012 - it fails when it is gone
            while True:
                gone.read(16)
        deadline = time.monotonic() + PATIENCE_S
        while not path.is_symlink() and time.monotonic() < deadline:
            threading.Event().wait(0.02)
        with serial.Serial(server.name, timeout=PATIENCE_S) as back:
            assert answers(back)


def test_the_bus_terminal_knows_the_baud_rate(tmp_path):
    ping, answer = bytes.fromhex("FF FF 03 02 01 F9"), bytes.fromhex("FF FF 03 02 00 FA")
    path = tmp_path / "bus"
    with served(bus_link=path):
        with serial.Serial(str(path), 500_000, timeout=0.3) as port:
            port.write(ping)
            assert port.read(12) == b""
        with serial.Serial(str(path), 1_000_000, timeout=PATIENCE_S) as port:
            port.write(ping)
            assert port.read(6) == answer


def test_rom_text_is_known_to_be_that_of_a_start():
    """`aero` tells a start by its marks, each stretch of the text included."""
    for cause in ("power_on", "brown_out", "reset"):
        assert rom_text(cause).startswith("ESP-ROM:")
        assert rom_text(cause).count("\r\n") >= 7
