"""Emulated hands on a bench, and frames to talk to them; encoded here once more, not borrowed from the emulator."""

from __future__ import annotations

import struct
from collections.abc import Callable

import pytest

from firmware_emulator.bench import Bench
from firmware_emulator.hand import EmulatedHand
from firmware_emulator.links.in_process import InProcessLink


class Host:
    """A bare client: frames out, frames in."""

    def __init__(self, **options):
        plant = options.pop("plant", None)
        self.hand = EmulatedHand(plant or Bench(), **options)
        self.link = InProcessLink(self.hand)

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


@pytest.fixture(scope="session")
def make_host() -> Callable[..., Host]:
    return Host
