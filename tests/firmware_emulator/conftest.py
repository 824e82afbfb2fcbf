"""Emulated hands on a bench, and frames to talk to them; encoded here once more, not borrowed from the emulator."""

import math
import struct
from collections.abc import Callable, Sequence

import pytest

from firmware_emulator.bench import Bench, BenchShaft
from firmware_emulator.bus import ServoBus
from firmware_emulator.hand import EmulatedHand
from firmware_emulator.links.in_process import InProcessLink

CLOSED_DEG = (288.16, 288.16, 288.16, 288.16, 100.0, 104.125, 247.15)
"""Where each shaft (command order) meets its closed end; the abduction's stop is at its open end instead."""
ABDUCTION = 4
AT_STOPS = tuple(0.0 if shaft == ABDUCTION else math.radians(closed) for shaft, closed in enumerate(CLOSED_DEG))
"""Shaft angles at which homing makes contact, rad, command order."""


class Host:
    """A bare client: frames out, frames in."""

    def __init__(self, **options):
        plant = options.pop("plant", None)
        self.hand = EmulatedHand(plant or Bench(), **options)
        self.link = InProcessLink(self.hand)
        self.link.log = []

    def send(self, opcode: int, *words: int) -> None:
        self.link.write(struct.pack("<BB7H", opcode, 0, *words, *[0] * (7 - len(words))))

    def ask(self, opcode: int, *words: int, timeout: float = 0.01) -> bytes:
        self.send(opcode, *words)
        return self.link.read(16, timeout)

    def words(self, opcode: int, *, signed: bool = False) -> tuple[int, ...]:
        frame = self.ask(opcode)
        assert frame[:2] == bytes((opcode, 0))
        return struct.unpack("<7h" if signed else "<7H", frame[2:])

    def wait(self, seconds: float) -> None:
        self.hand.clock.sleep_until(self.hand.clock.now() + seconds)


def stopped_bench(angles: Sequence[float] = (0.0,) * 7, *, friction: float = 0.0, stiffness: float = 2000.0) -> Bench:
    """Seven shafts with the end stops that homing looks for, and nothing else to hold them."""
    shafts = []
    for shaft, closed in enumerate(CLOSED_DEG):
        stop = {"stop_low": 0.0} if shaft == ABDUCTION else {"stop_high": math.radians(closed)}
        shafts.append(BenchShaft(friction=friction, stop_stiffness=stiffness, **stop))
    return Bench(tuple(shafts), angles=tuple(angles))


def frame(text: str) -> bytes:
    return bytes.fromhex(text).ljust(16, b"\0")


@pytest.fixture(scope="session")
def make_host() -> Callable[..., Host]:
    return Host


class Listener:
    """Hears every write of a master to a servo bus, with its time."""

    def __init__(self, bus: ServoBus, log: list[tuple[float, bytes]]) -> None:
        self._bus, self._log = bus, log

    def asked(self, data: bytes) -> None:
        self._log.append((self._bus.kernel.now, data))

    def answered(self, data: bytes) -> bytes:
        return data


@pytest.fixture
def bus_log(monkeypatch) -> list[tuple[float, bytes]]:
    """Every write of a master to the bus of a hand that is made from here on."""
    log: list[tuple[float, bytes]] = []

    def heard_bus(*arguments: object) -> ServoBus:
        bus = ServoBus(*arguments)
        bus.tap = Listener(bus, log)
        return bus

    monkeypatch.setattr("firmware_emulator.servo_chain.ServoBus", heard_bus)
    return log
