"""The telemetry cache: the last complete reading of all servos, as the host words that the board answers with.

The board reads a hundred times a second and a host asks less often, so words are worked out when they are asked for.
"""

from __future__ import annotations

from collections.abc import Sequence
from struct import Struct

from firmware_emulator.firmware.frames import CHANNELS, to_host

_BLOCK = Struct("<HH3xB5xH")
"""Position, speed, temperature and current in the feedback block."""


class Telemetry:
    """Feedback blocks by servo ID, and the window they were read with."""

    def __init__(self, blocks: Sequence[bytes], extend: Sequence[int], grasp: Sequence[int]) -> None:
        """Keep blocks of registers 56 to 70, and both ends of the window (counts) as they are now."""
        self._blocks, self._extend, self._grasp = blocks, extend, grasp
        self._unpacked: tuple[tuple[int, ...], ...] | None = None

    @property
    def positions(self) -> Sequence[int]:
        """Share of the window, 0..65535."""
        return list(map(to_host, self._registers()[0], self._extend, self._grasp))

    @property
    def speeds(self) -> Sequence[int]:
        """Signed, register units."""
        return list(map(_signed, self._registers()[1]))

    @property
    def currents(self) -> Sequence[int]:
        """Signed, register units."""
        return list(map(_signed, self._registers()[3]))

    @property
    def temperatures(self) -> Sequence[int]:
        """°C."""
        return self._registers()[2]

    def _registers(self) -> tuple[tuple[int, ...], ...]:
        if self._unpacked is None:
            self._unpacked = tuple(zip(*map(_BLOCK.unpack, self._blocks), strict=True))
        return self._unpacked


NOTHING_READ = Telemetry((bytes(_BLOCK.size),) * CHANNELS, (0,) * CHANNELS, (0,) * CHANNELS)
"""What the cache holds until all servos have answered once: zeros."""


def _signed(word: int) -> int:
    """Value of a sign-magnitude register word."""
    return word if word < 0x8000 else 0x8000 - word
