"""The seeded sessions: every case that a board has to get right, and random ones."""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from firmware_emulator.firmware.frames import FRAME, Opcode
from firmware_emulator.firmware.setup_and_loop import ResetCause


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
    steps: tuple[Step, ...]
    start: ResetCause = "reset"
    stored: tuple[tuple[str, int], ...] = ()
    """What is in the storage at first."""
    stops: bool = True
    """Whether the shafts meet the ends that homing looks for."""

    @property
    def frames(self) -> int:
        """Frames that the host sends, whole ones' worth of bytes."""
        return sum(len(step.data) for step in self.steps if isinstance(step, Send)) // 16


EDGES = (0, 1, 4, 5, 6, 7, 8, 199, 200, 253, 254, 255, 256, 1000, 1001, 1023, 1024, 32766, 32767, 32768, 40000, 65535)
"""Words at which the firmware changes its mind, and their neighbours."""
GETS = (Opcode.GET_POS, Opcode.GET_VEL, Opcode.GET_CURR, Opcode.GET_TEMP)
ALL_VERSIONS = tuple(code for code in Opcode if code != Opcode.CALIBRATE_MID)
"""What the sessions of all versions ask; `calibrate_mid` has the rest."""
QUICK = tuple(code for code in ALL_VERSIONS if code not in {Opcode.HOMING, Opcode.SET_ID})
SETTLED = Await(2000, 0.6)
"""After a boot without homing."""
BOOTED = Await(2000, 6.0)
"""After one that may home."""


def frame(code: int, *words: int) -> bytes:
    """Return a host frame."""
    return FRAME.pack(code, 0, *words, *[0] * (7 - len(words)))


def _pause(rng: random.Random) -> Wait:
    """Nothing, whole ticks or any time, up to 25 ms."""
    return Wait(rng.choice((0, 1000 * rng.randrange(25), 10 * rng.randrange(2500))))


def _any_frame(rng: random.Random) -> bytes:
    code = rng.choice(QUICK)
    words = [rng.choice(EDGES) if rng.random() < 0.5 else rng.randrange(65536) for _ in range(7)]
    if code in {Opcode.TRIM, Opcode.SET_SPE, Opcode.SET_TOR}:
        words[0] = rng.randrange(8) if rng.random() < 0.9 else words[0]
        # Trims of some degrees, so that the windows stay windows.
        words[1] = rng.randrange(-20, 21) & 0xFFFF if code == Opcode.TRIM and rng.random() < 0.9 else words[1]
    return frame(code, *words)


def _gets() -> list[Step]:
    return [Send(b"".join(frame(code) for code in GETS)), Wait(1000)]


def boot(rng: random.Random) -> list[Session]:
    """All causes, with every servo and with some missing."""
    causes: tuple[ResetCause, ...] = ("power_on", "reset", "brown_out")
    some = tuple(sorted(rng.sample(range(7), 5)))
    return [
        Session(f"boot after {cause}, servos {list(present)}", (Servos(present), BOOTED, *_gets()), cause)
        for cause in causes
        for present in (tuple(range(7)), some)
    ]


def homing(rng: random.Random) -> list[Session]:
    """Homing on request, and frames that wait for its end; without a stop to find; with a current limit to repair."""
    home: tuple[Step, ...] = (Send(frame(Opcode.HOMING)), Wait(7000), Send(frame(Opcode.GET_POS)), Await(32, 200.0))
    steps: list[Step] = [SETTLED, Wait(10 * rng.randrange(5000)), *home, *_gets(), Wait(50_000), *_gets()]
    weak = rng.randrange(7)
    weaken = Send(frame(Opcode.SET_ID, weak, 500))
    weakened: tuple[Step, ...] = (SETTLED, Servos((weak,)), weaken, Await(16, 3.5), Servos(tuple(range(7))))
    return [
        Session("homing", tuple(steps)),
        Session("homing in vain", tuple(steps), stops=False),
        Session("homing with a weak servo", (*weakened, *home, *_gets())),
    ]


def opcodes(rng: random.Random) -> list[Session]:
    """Every opcode with every edge as channel and as value; opcodes that nobody knows."""
    steps: list[Step] = [SETTLED]
    for code in QUICK:
        for edge in EDGES:
            channel = rng.randrange(7)
            steps += [Send(frame(code, *[edge] * 7)), _pause(rng), Send(frame(code, channel, edge)), _pause(rng)]
        steps += _gets()
    unknown = [code for code in range(256) if code not in ALL_VERSIONS]
    steps += [step for code in rng.sample(unknown, 40) for step in (Send(frame(code, 1, 2, 3)), _pause(rng))]
    return [Session("opcodes", (*steps, *_gets()))]


def torque(rng: random.Random) -> list[Session]:
    """Torque mode out of the window and back, with changes of mode and heat."""
    steps: list[Step] = [SETTLED]
    for _ in range(40):
        match rng.randrange(5):
            case 0:
                steps.append(Send(frame(Opcode.CTRL_POS, *[rng.randrange(65536) for _ in range(7)])))
            case 1:
                steps.append(Heat(rng.randrange(7), rng.choice((30.0, 49.0, 50.0, 51.0, 69.0, 70.0, 75.0))))
            case 2:
                steps.append(Send(frame(Opcode.TRIM, rng.randrange(7), rng.randrange(-30, 31) & 0xFFFF)))
            case _:
                steps.append(Send(frame(Opcode.CTRL_TOR, *[rng.choice((0, 3, 100, 300, 600, 1000)) for _ in range(7)])))
        steps += [Wait(rng.choice((1000, 5000, 10 * rng.randrange(5000), 150_000))), *_gets()]
    return [Session("torque mode", tuple(steps))]


def set_id(rng: random.Random) -> list[Session]:
    """SET_ID on buses of 0, 1, 2 and 7 servos."""
    sessions = []
    for count in (0, 1, 2, 7):
        present = tuple(sorted(rng.sample(range(7), count)))
        steps: list[Step] = [SETTLED, Servos(present)]
        ids = [rng.choice((*present, 9)), rng.randrange(254), rng.choice((253, 254, 255))]
        for new in ids:
            data = frame(Opcode.SET_ID, rng.choice((new, new | 0x3000)), rng.choice((0, 500, 1023, 1024, 65535)))
            steps += [Send(data), Await(16, 3.5), _pause(rng)]
        sessions.append(Session(f"SET_ID with {count} servos", (*steps, *_gets())))
    # A servo that is plugged in when the scan has passed its ID has the number that is asked for.
    early, late = sorted(rng.sample(range(7), 2))
    steps = [SETTLED, Servos((late,)), Send(frame(Opcode.SET_ID, early, 700)), Wait(1_000_000), Servos((early, late))]
    return [*sessions, Session("SET_ID of a number that appears", (*steps, Await(16, 3.5), *_gets()))]


def split(rng: random.Random) -> list[Session]:
    """Frames that arrive in pieces, slowly or in bursts beyond the queue."""
    steps: list[Step] = [SETTLED]
    for _ in range(80):
        data = b"".join(_any_frame(rng) for _ in range(rng.choice((1, 1, 2, 5, 20))))
        while data:
            size = rng.choice((1, 5, 15, 16, 17, 100, 300))
            steps += [Send(data[:size]), _pause(rng)]
            data = data[size:]
    return [Session("split frames", tuple(steps))]


def garbage(rng: random.Random) -> list[Session]:
    """Bytes that are no frames, without the opcodes that take long."""
    steps: list[Step] = [SETTLED]
    for _ in range(150):
        data = rng.randbytes(rng.randrange(1, 40)).translate(None, bytes((Opcode.HOMING, Opcode.SET_ID)))
        steps += [Send(data), _pause(rng)]
    return [Session("garbage", (*steps, *_gets()))]


def damage(rng: random.Random) -> list[Session]:
    """Answers of the servos that are cut, wrong, missing or behind stray bytes, in every mode and while booting."""
    kinds: tuple[Callable[[], dict[str, Any]], ...] = (
        lambda: {"keep": rng.choice((0, 1, 2, 5, 20, 126, 131, 140, 146))},
        lambda: {"flip": rng.randrange(147)},
        lambda: {"before": rng.choice((b"\0", b"\xff", b"\xff\xff", b"\xff\xff\x05", rng.randbytes(12)))},
        lambda: {"replace": bytes.fromhex("ff ff 05 00 de 06 12")},
        lambda: {"replace": rng.randbytes(rng.randrange(1, 160))},
        lambda: {"flip": rng.randrange(8)},
    )

    def any_damage() -> Damage:
        return Damage(rng.randrange(12), **kinds[rng.randrange(len(kinds))]())

    steps: list[Step] = [*(any_damage() for _ in range(3)), SETTLED]
    for _ in range(80):
        steps += [any_damage(), Send(_any_frame(rng)), _pause(rng), *_gets()]
    return [Session("damaged answers", tuple(steps))]


def resets(rng: random.Random) -> list[Session]:
    """Settings and trims, then resets; values in the storage that count and that do not."""
    causes: tuple[ResetCause, ...] = ("reset", "brown_out", "reset", "power_on")
    stored = tuple(
        (f"ext{channel}", rng.choice((-1, 0, 1000, 4095, 4096, 2048))) for channel in rng.sample(range(7), 4)
    )
    steps: list[Step] = [SETTLED]
    for cause in causes:
        for _ in range(6):
            steps += [Send(_any_frame(rng)), _pause(rng)]
        steps += [*_gets(), Reset(cause), Wait(10 * rng.randrange(2000)), Send(_any_frame(rng)), BOOTED]
    return [Session("resets", (*steps, *_gets()), stored=stored)]


def fuzz(rng: random.Random) -> list[Session]:
    """Random frames, mostly in bursts that just fit the queue."""
    steps: list[Step] = [SETTLED]
    sent = 0
    while sent < 2000:
        count = rng.choice((1, 2, 4, 8, 16))
        steps += [Send(b"".join(_any_frame(rng) for _ in range(count))), _pause(rng)]
        sent += count
    return [Session("fuzz", (*steps, *_gets()))]


def calibrate_mid(rng: random.Random) -> list[Session]:
    """CALIBRATE_MID in both modes, of every channel and of none, with damaged answers, and what comes after it."""

    def calibrated(channel: int) -> list[Step]:
        return [Send(frame(Opcode.CALIBRATE_MID, channel, rng.randrange(65536))), Await(16, 0.3), *_gets()]

    def moved() -> list[Step]:
        return [Send(frame(Opcode.CTRL_POS, *[rng.randrange(65536) for _ in range(7)])), _pause(rng)]

    every: list[Step] = [SETTLED]
    six = Servos(tuple(sorted(rng.sample(range(7), 6))))
    mixed: list[Step] = [SETTLED, six, *calibrated(3), Servos(tuple(range(7)))]
    for channel in (*range(8), 0xFF03):
        every += [*moved(), *calibrated(channel), Send(frame(Opcode.TRIM, channel, rng.randrange(20))), *_gets()]
    for _ in range(30):
        mixed += [Damage(rng.randrange(9), keep=rng.choice((0, 1, 5, 7, 1000)), flip=rng.randrange(8))]
        mixed += [*calibrated(rng.randrange(7)), Send(_any_frame(rng)), _pause(rng)]
        mixed += [Send(frame(Opcode.TRIM, rng.randrange(7), 2)), *_gets()]
    home: list[Step] = [SETTLED, *moved(), *calibrated(2), Send(frame(Opcode.HOMING)), Await(16, 60.0), *_gets()]
    again: list[Step] = [*calibrated(4), Reset("reset"), SETTLED, *_gets(), *moved(), *_gets()]
    return [
        Session("CALIBRATE_MID on every channel", tuple(every)),
        Session("CALIBRATE_MID among other frames and damaged answers", tuple(mixed)),
        Session("CALIBRATE_MID, then homing and a reset", (*home, *again)),
    ]


MAKERS: dict[str, Callable[[random.Random], list[Session]]] = {
    make.__name__: make
    for make in (boot, homing, opcodes, torque, set_id, split, garbage, damage, resets, fuzz, calibrate_mid)
}
"""What can be asked for by name."""


def sessions(name: str, seed: int) -> list[Session]:
    """Return the sessions of a name; the same seed gives the same."""
    return MAKERS[name](random.Random(f"{name} {seed}"))
