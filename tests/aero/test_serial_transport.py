import os
import select
import socket
import threading
import tty

import pytest
import serial

from aero import AeroHand
from aero.serial_transport import SerialTransport


@pytest.fixture
def pty_pair():
    master, slave = os.openpty()
    tty.setraw(slave)
    yield master, os.ttyname(slave)
    for descriptor in (master, slave):
        os.close(descriptor)


def test_bytes_go_both_ways(pty_pair):
    master, path = pty_pair
    transport = SerialTransport.open(path)
    transport.write(b"hello")
    assert os.read(master, 5) == b"hello"
    os.write(master, b"sixteen bytes...+")
    assert transport.read(16, 1.0) == b"sixteen bytes..."
    assert transport.read(16, 0.01) == b"+"
    assert transport.name == path
    transport.close()
    transport.close()


def test_a_read_without_patience_takes_what_is_there(pty_pair):
    master, path = pty_pair
    with serial.Serial(path, timeout=0.01) as port:
        transport = SerialTransport(port, path)
        assert transport.read(100, 0.0) == b""
        os.write(master, b"abc")
        select.select([port], [], [], 1.0)
        assert transport.read(100, 0.0) == b"abc"
        os.write(master, b"old")
        select.select([port], [], [], 1.0)
        transport.discard_input()
        assert transport.read(100, 0.0) == b""


def test_a_hand_behind_a_port(pty_pair):
    master, path = pty_pair

    def board():
        os.read(master, 16)
        os.write(master, bytes([0x25, 0, *[30, 0] * 7]))

    server = threading.Thread(target=board)
    server.start()
    with AeroHand.open_unguarded(path) as hand:
        assert hand.read_temperatures().tolist() == [30.0] * 7
    server.join()


def test_one_program_per_port(pty_pair):
    _, path = pty_pair
    first = SerialTransport.open(path)
    with pytest.raises(ConnectionError, match="another program"):
        SerialTransport.open(path)
    first.close()


def test_a_missing_port_is_named_with_what_to_try():
    with pytest.raises(ConnectionError, match=r"cannot open /dev/no-such-hand: there is no such port.*Serial ports on"):
        SerialTransport.open("/dev/no-such-hand")


def test_a_closed_port_says_so(pty_pair):
    transport = SerialTransport.open(pty_pair[1])
    transport.close()
    for call in (lambda: transport.write(b"x"), lambda: transport.read(1, 0.0), transport.discard_input):
        with pytest.raises(ConnectionError, match="closed by this program"):
            call()


CALLS = {
    "write": lambda transport: transport.write(b"x" * 16),
    "read": lambda transport: transport.read(16, 5.0),
    "discard_input": lambda transport: transport.discard_input(),
}


@pytest.mark.parametrize("call", CALLS)
def test_a_descriptor_that_somebody_has_closed_is_a_connection_error(pty_pair, call):
    transport = SerialTransport.open(pty_pair[1])
    os.close(transport._port.fd)
    with pytest.raises(ConnectionError, match="cannot"):
        CALLS[call](transport)
    transport._port.fd = os.open(os.devnull, os.O_RDWR)  # for closing
    transport.close()


def test_a_port_that_another_thread_closes_during_a_read_is_a_connection_error(pty_pair):
    for _ in range(20):
        transport = SerialTransport.open(pty_pair[1])
        closing = threading.Timer(0.01, transport.close)
        closing.start()
        with pytest.raises(ConnectionError, match=r"closed by this program|unplugged"):
            transport.read(16, 5.0)
        closing.join()


def test_an_unplugged_port_is_a_connection_error():
    master, slave = os.openpty()
    tty.setraw(slave)
    transport = SerialTransport.open(os.ttyname(slave))
    os.close(slave)
    os.close(master)
    with pytest.raises(ConnectionError, match="unplugged"):
        transport.read(16, 0.1)
    with pytest.raises(ConnectionError, match="unplugged"):
        transport.write(b"x" * 16)
    transport.close()


def test_urls_are_opened_like_ports():
    transport = SerialTransport.open("loop://")
    transport.write(b"echo")
    assert transport.read(4, 1.0) == b"echo"
    transport.close()


def test_a_hand_behind_a_network_port():
    with socket.create_server(("127.0.0.1", 0)) as server:

        def board():
            connection, _ = server.accept()
            with connection:
                connection.recv(16)
                connection.sendall(bytes([0x25, 0, *[30, 0] * 7]))
                connection.recv(16)

        bench = threading.Thread(target=board)
        bench.start()
        with AeroHand.open_unguarded(f"socket://127.0.0.1:{server.getsockname()[1]}") as hand:
            assert hand.read_temperatures().tolist() == [30.0] * 7
        bench.join()


def test_a_network_port_where_nobody_listens():
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
    with pytest.raises(ConnectionError, match=rf"cannot open socket://127.0.0.1:{port}"):
        SerialTransport.open(f"socket://127.0.0.1:{port}")
