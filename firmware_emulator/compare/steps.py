"""What a session consists of: what the host, the wire and the world do to a board, one step after the other."""

from __future__ import annotations

from dataclasses import dataclass

from firmware_emulator.firmware.boot import ResetCause


@dataclass(frozen=True)
class Send:
    """The host writes bytes."""

    data: bytes


@dataclass(frozen=True)
class Wait:
    """Time passes."""

    microseconds: int


@dataclass(frozen=True)
class Await:
    """Time passes until the board has sent so many bytes more, or for as long as given."""

    count: int
    longest_s: float


@dataclass(frozen=True)
class Reset:
    """The board restarts; its storage stays."""

    cause: ResetCause


@dataclass(frozen=True)
class Damage:
    """One answer of the servos arrives damaged."""

    after: int
    """How many answers pass unharmed first."""
    keep: int = 1000
    """How many of its bytes arrive."""
    flip: int = -1
    """Index of a byte whose bits are turned over; none when negative."""
    before: bytes = b""
    """Stray bytes in front."""
    replace: bytes | None = None
    """What arrives in its place."""

    def applied(self, data: bytes) -> bytes:
        """Return what arrives of an answer."""
        if self.replace is not None:
            return self.replace
        changed = bytearray(data)
        if 0 <= self.flip < len(changed):
            changed[self.flip] ^= 0xFF
        return self.before + bytes(changed[: self.keep])


@dataclass(frozen=True)
class Servos:
    """Only these servos are on the bus from now on, by the ID that they began with."""

    present: tuple[int, ...]


@dataclass(frozen=True)
class Heat:
    """A servo has a temperature."""

    servo: int
    celsius: float


Step = Send | Wait | Await | Reset | Damage | Servos | Heat


@dataclass(frozen=True)
class Session:
    """A board's life from a reset on."""

    name: str
    start: ResetCause
    steps: tuple[Step, ...]
    stored: tuple[tuple[str, int], ...] = ()
    """What is in the storage at first."""
    stops: bool = True
    """Whether the shafts meet the ends that homing looks for."""

    @property
    def frames(self) -> int:
        """Frames that the host sends, whole ones' worth of bytes."""
        return sum(len(step.data) for step in self.steps if isinstance(step, Send)) // 16
