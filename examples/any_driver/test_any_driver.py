"""Drivers in three languages on an emulated hand, with a fault injected in the middle: `pytest examples/any_driver`.

Each closes all channels to the same code, opens them, and closes them again after the motor of the ring finger died.
"""

import shutil
import subprocess
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from time import sleep

import pytest

from hil import ServedPort

HERE = Path(__file__).parent
MIDDLE, RING = 4, 5
"""Places in the wire order: thumb abduction, CMC flexion, flexor, index, middle, ring, pinky."""
CLOSED, ARRIVED, ASIDE = 30000, 26000, 6000
"""Code of a half-closed hand; least position of a finger that followed; largest of one that stayed open."""
Follow = Callable[[int], Sequence[float]]
"""Sends a code to all channels, and returns the seven positions after 0.8 s, wire order."""


def check(port: ServedPort, follow: Follow) -> None:
    """Drive the hand with and without the fault; the driver sees it, and the hand's true motion agrees."""
    assert min(follow(CLOSED)) > ARRIVED
    follow(0)
    port.inject("motor_dead:ring")
    positions = follow(CLOSED)
    assert positions[MIDDLE] > ARRIVED
    assert positions[RING] < ASIDE
    bent = port.telemetry().measured[-1]  # rad, command order: index, middle, ring, pinky and thumb
    assert bent[1] > 2.0 * bent[2]


@contextmanager
def program(*command: str | Path) -> Iterator[Follow]:
    """Run a program that reads codes and prints positions."""
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, text=True, bufsize=1) as running:
        assert running.stdin is not None
        assert running.stdout is not None
        sent, printed = running.stdin, running.stdout

        def follow(code: int) -> Sequence[float]:
            sent.write(f"{code}\n")
            return [float(word) for word in printed.readline().split()]

        yield follow
        sent.close()


@pytest.mark.skipif(shutil.which("cc") is None, reason="needs a C compiler")
def test_a_driver_in_c(aero_port: ServedPort, tmp_path: Path) -> None:
    """`follow.c`."""
    subprocess.run(["cc", "-o", tmp_path / "follow", HERE / "follow.c"], check=True)
    with program(tmp_path / "follow", aero_port.path) as follow:
        check(aero_port, follow)


@pytest.mark.skipif(shutil.which("node") is None, reason="needs Node")
def test_a_driver_in_javascript(aero_port: ServedPort) -> None:
    """`follow.mjs`."""
    with program("node", HERE / "follow.mjs", aero_port.path) as follow:
        check(aero_port, follow)


def test_the_sdk_of_the_maker(aero_port: ServedPort) -> None:
    """`aero-open-sdk`, unmodified; it works in degrees."""
    sdk = pytest.importorskip("aero_open_sdk.aero_hand")
    hand = sdk.AeroHand(aero_port.path)

    def follow(code: int) -> Sequence[float]:
        low, high = hand.actuation_lower_limits, hand.actuation_upper_limits
        share = code / 65535
        hand.set_actuations([a + share * (b - a) for a, b in zip(low, high, strict=True)])
        sleep(0.8)
        while (found := hand.get_actuations()) is None:
            pass  # the SDK waits 10 ms for an answer, less than a busy computer may need
        return [65535 * (x - a) / (b - a) for x, a, b in zip(found, low, high, strict=True)]

    try:
        check(aero_port, follow)
    finally:
        hand.close()
