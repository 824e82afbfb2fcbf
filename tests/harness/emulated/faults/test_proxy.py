"""`aero-hil proxy` and `aero-hil emulate --fault` as a user starts them, and the proxy's order of bytes."""

import contextlib
import os
import signal
import subprocess
import sys

import pytest
import serial
from click.testing import CliRunner
from full_disk import limited

from aero.clock import WallClock
from hil.cli import main
from hil.emulated.faults import Schedule, parse_fault
from hil.emulated.faults.proxy import LinkProxy

PATIENCE_S = 20.0
ASK = bytes([0x22]).ljust(16, b"\0")


@contextlib.contextmanager
def started(*arguments, code=0, says="", stop=True, largest_file=None):
    """A command that serves a port; yields the path, and checks how it ends, by itself unless it is to be stopped."""
    command = [sys.executable, "-m", "hil.cli", *map(str, arguments)]
    pipe = subprocess.PIPE
    command = command if largest_file is None else limited(largest_file) + command
    with subprocess.Popen(command, stdout=pipe, stderr=pipe, text=True) as process:
        try:
            ready = process.stdout.readline().split(maxsplit=1)
            assert ready[0] == "ready", process.communicate(timeout=PATIENCE_S)
            yield ready[1].strip()
        finally:
            if stop:
                process.send_signal(signal.SIGTERM)
            _, errors = process.communicate(timeout=PATIENCE_S)
        assert (process.returncode, says in errors) == (code, True), errors


@pytest.fixture(scope="module")
def hand():
    """The port of a hand, which one proxy after the other serves."""
    with started("emulate") as path:
        yield path


def asked(path, times=1):
    with serial.Serial(path, timeout=PATIENCE_S) as port:
        answers = []
        for _ in range(times):
            port.write(ASK)
            answers.append(port.read(16))
        return answers


def test_a_proxy_passes_bytes_on_and_puts_faults_between(hand, tmp_path):
    link = tmp_path / "proxied"
    with started("proxy", hand, "--link", link, "--fault", "reply_other_opcode=1") as path:
        assert path == str(link)
        answer = asked(path)[0]
        assert (len(answer), answer[0] in {0x23, 0x24, 0x25}) == (16, True)
    assert not link.is_symlink()


ON_A_FULL_DISK = {"code": 5, "says": "the recording ends here, the link continues", "largest_file": 20_000}


@pytest.mark.skipif(os.name != "posix", reason="needs a limit on the size of files")
def test_a_recording_on_a_full_disk_does_not_end_the_link(tmp_path):
    """500 replies are more than the file takes."""
    with (
        started("emulate", "--record", tmp_path / "hand.mcap", **ON_A_FULL_DISK) as hand,
        started("proxy", hand, "--record", tmp_path / "proxy.mcap", **ON_A_FULL_DISK) as path,
    ):
        assert {(len(answer), answer[0]) for answer in asked(path, times=500)} == {(16, 0x22)}


def test_a_listener_that_fails_is_dropped_and_the_link_goes_on():
    proxy = LinkProxy(Echo(), Schedule())
    heard, received = [], bytearray()
    proxy.listeners += [lambda *_piece: 1 / 0, lambda *piece: heard.append(piece)]
    with contextlib.closing(proxy), serial.Serial(proxy.name, timeout=0) as port:
        port.write(ASK)

        def enough():
            received.extend(port.read(64))
            return len(received) >= len(ASK)

        proxy.run(enough)
    assert [direction for direction, _ in heard] == ["to_hand", "from_hand"]


def test_a_port_that_hangs_up_ends_the_proxy(hand):
    with (
        started("proxy", hand, "--fault", "link_hangs_up@0.2", stop=False) as path,
        serial.Serial(path, timeout=PATIENCE_S) as port,
        pytest.raises(OSError, match=r"Input/output error|returned no data"),
    ):
        ask_for_ever(port)


def ask_for_ever(port):
    while port.write(ASK):
        port.read(16)


def test_a_fault_that_never_fired_is_said_when_the_proxy_ends(hand):
    with started("proxy", hand, "--fault", "boot_text@600", code=2, says="never fired") as path:
        assert asked(path)[0][0] == 0x22


@pytest.mark.parametrize(
    ("arguments", "code", "says"),
    [
        (("proxy", "/dev/ttyNoSuchHand"), 3, "no such port"),
        (("proxy", "/dev/ttyNoSuchHand", "--fault", "gremlin"), 2, "unknown fault 'gremlin'"),
        (("emulate", "--fault", "motor_weak:toe"), 2, "unknown channel 'toe'"),
        (("emulate", "--fault", "motor_dead", "--fault", "motor_runaway"), 2, "cannot be combined"),
    ],
)
def test_what_cannot_be_is_said_in_one_line(arguments, code, says):
    ended = CliRunner().invoke(main, arguments)
    assert (ended.exit_code, says in ended.output, ended.output.count("\n")) == (code, True, 1), ended.output


def test_an_emulated_hand_is_served_with_its_faults():
    with started("emulate", "--fault", "reply_doubled=1") as path, serial.Serial(path, timeout=PATIENCE_S) as port:
        port.write(ASK)
        first = port.read(16)
        assert port.read(16) == first


def test_the_ids_of_a_fault_that_is_none_of_the_link_are_refused():
    with pytest.raises(ValueError, match="a proxy has faults of the link only"):
        LinkProxy(None, Schedule([parse_fault("motor_dead")]))


class Echo:
    """A port that answers what it is sent."""

    name = "echo"

    def __init__(self):
        self.clock, self.held = WallClock(), b""

    def write(self, data):
        self.held += data

    def read(self, size, timeout):
        if not self.held:
            self.clock.sleep_until(self.clock.now() + min(timeout, 0.005))
        data, self.held = self.held[:size], self.held[size:]
        return data


class Cut(Echo):
    """A port that is gone once something was sent."""

    def read(self, size, timeout):
        if self.held:
            raise ConnectionError("cannot read from the cut port")
        return super().read(size, timeout)


def test_a_hand_that_is_unplugged_ends_the_proxy():
    with contextlib.closing(LinkProxy(Cut(), Schedule())) as proxy, serial.Serial(proxy.name) as port:
        port.write(ASK)
        late = WallClock().now() + PATIENCE_S
        with pytest.raises(ConnectionError, match="cut port"):
            proxy.run(lambda: WallClock().now() > late)


def test_bytes_keep_their_order_through_delays(tmp_path):
    proxy = LinkProxy(Echo(), Schedule([parse_fault("reply_delayed=20"), parse_fault("command_delayed=20")], seed=1))
    sent = bytes(range(1, 200))
    received = bytearray()
    with contextlib.closing(proxy), serial.Serial(proxy.name, timeout=0) as port:
        position = iter(range(0, len(sent), 7))

        def enough():
            at = next(position, None)
            if at is not None:
                port.write(sent[at : at + 7])
            received.extend(port.read(64))
            return len(received) >= len(sent)

        proxy.run(enough)
    assert bytes(received) == sent
