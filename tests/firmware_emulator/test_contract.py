"""The link contract on the in-process link and over a pseudo-terminal; with `--hil=PORT` on that port instead."""

import contextlib
import threading

import pytest
import serial

from firmware_emulator.hand import EmulatedHand
from firmware_emulator.links.in_process import InProcessLink
from firmware_emulator.links.pty import PtyServer
from tests.firmware_emulator.conftest import stopped_bench
from tests.firmware_emulator.link_contract import CONTRACT


class SerialLink:
    """A serial port with the waiting made explicit."""

    def __init__(self, port):
        self._port = port
        self.write = port.write
        self.discard_input = port.reset_input_buffer

    def read(self, size, timeout):
        self._port.timeout = timeout
        return self._port.read(size)


@contextlib.contextmanager
def in_process():
    yield InProcessLink(EmulatedHand(stopped_bench()))


@contextlib.contextmanager
def over_a_port(path):
    with serial.Serial(path, 921600) as port:
        yield SerialLink(port)


@contextlib.contextmanager
def over_a_pty():
    with PtyServer(EmulatedHand(stopped_bench())) as server:
        stop = threading.Event()
        thread = threading.Thread(target=server.run, args=(stop.is_set,))
        thread.start()
        try:
            with over_a_port(server.name) as link:
                yield link
        finally:
            stop.set()
            thread.join()


@pytest.fixture(params=["in_process", "pty"])
def open_link(request):
    target = request.config.getoption("--hil", None)
    if target not in {None, "emulated", "pty"}:
        if request.param == "pty":
            pytest.skip("one run on the physical port is enough")
        return lambda: over_a_port(target)
    return {"in_process": in_process, "pty": over_a_pty}[request.param]


@pytest.mark.parametrize("promise", CONTRACT, ids=lambda promise: promise.__name__)
def test_contract(promise, open_link):
    promise(open_link)
