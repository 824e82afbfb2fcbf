"""Seeded sessions: edge cases of every board function, and random input."""

import random
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from firmware_emulator.firmware.frames import FRAME, Opcode
from firmware_emulator.firmware.setup_and_loop import ResetCause


@dataclass(frozen=True)
class Send:
    """Write bytes from the host."""

    data: bytes


@dataclass(frozen=True)
class Wait:
    """Wait a fixed time."""

    microseconds: int


@dataclass(frozen=True)
class Await:
    """Wait until the board has sent `count` more bytes, or until a time-out."""

    count: int
    longest_s: float


@dataclass(frozen=True)
class Reset:
    """Restart the board, keeping its storage."""

    cause: ResetCause


@dataclass(frozen=True)
class Damage:
    """Corrupt one answer of the servos."""

    after: int
    """Number of intact answers before the corrupted one."""
    keep: int = 1000
    """Number of bytes delivered; the rest is cut off."""
    flip: int = -1
    """Index of a byte to invert; negative for none."""
    before: bytes = b""
    """Stray bytes before the answer."""
    replace: bytes | None = None
    """Bytes delivered instead of the answer; None for the answer itself."""

    def applied(self, data: bytes) -> bytes:
        """Return an answer with this damage applied."""
        if self.replace is not None:
            return self.replace
        changed = bytearray(data)
        if 0 <= self.flip < len(changed):
            changed[self.flip] ^= 0xFF
        return self.before + bytes(changed[: self.keep])


@dataclass(frozen=True)
class Servos:
    """Leave only these servos on the bus, by their initial IDs."""

    present: tuple[int, ...]


@dataclass(frozen=True)
class Heat:
    """Set the temperature of a servo."""

    servo: int
    celsius: float


Step = Send | Wait | Await | Reset | Damage | Servos | Heat


@dataclass(frozen=True)
class Session:
    """Sequence of steps on a board, starting with a reset."""

    name: str
    steps: tuple[Step, ...]
    start: ResetCause = "reset"
    stored: tuple[tuple[str, int], ...] = ()
    """Initial keys and numbers of the storage."""
    stops: bool = True
    """Whether the shafts have end stops for homing."""

    @property
    def frames(self) -> int:
        """Number of frames sent by the host: bytes divided by the frame size."""
        return sum(len(step.data) for step in self.steps if isinstance(step, Send)) // 16


EDGES = (0, 1, 4, 5, 6, 7, 8, 199, 200, 253, 254, 255, 256, 1000, 1001, 1023, 1024, 32766, 32767, 32768, 40000, 65535)
"""Edge values of the firmware's words, with their neighbours."""
GETS = (Opcode.GET_POS, Opcode.GET_VEL, Opcode.GET_CURR, Opcode.GET_TEMP)
ALL_VERSIONS = tuple(code for code in Opcode if code != Opcode.CALIBRATE_MID)
"""Opcodes of sessions for all versions: all except CALIBRATE_MID, which has its own session."""
QUICK = tuple(code for code in ALL_VERSIONS if code not in {Opcode.HOMING, Opcode.SET_ID})
SETTLED = Await(2000, 0.6)
"""Wait for the end of a boot without homing."""
BOOTED = Await(2000, 6.0)
"""Wait for the end of a boot that may home."""


def frame(code: int, *words: int) -> bytes:
    """Return a host frame of up to seven words, padded with zeros."""
    return FRAME.pack(code, 0, *words, *[0] * (7 - len(words)))


def _pause(rng: random.Random) -> Wait:
    """Return a random wait up to 25 ms: zero, whole ticks, or any time."""
    return Wait(rng.choice((0, 1000 * rng.randrange(25), 10 * rng.randrange(2500))))


def _any_frame(rng: random.Random) -> bytes:
    code = rng.choice(QUICK)
    words = [rng.choice(EDGES) if rng.random() < 0.5 else rng.randrange(65536) for _ in range(7)]
    if code in {Opcode.TRIM, Opcode.SET_SPE, Opcode.SET_TOR}:
        words[0] = rng.randrange(8) if rng.random() < 0.9 else words[0]
        # Trims of a few degrees, so that the windows stay valid.
        words[1] = rng.randrange(-20, 21) & 0xFFFF if code == Opcode.TRIM and rng.random() < 0.9 else words[1]
    return frame(code, *words)


def _gets() -> list[Step]:
    return [Send(b"".join(frame(code) for code in GETS)), Wait(1000)]


def boot(rng: random.Random) -> list[Session]:
    """Boot after each reset cause, with all servos and with two missing."""
    causes: tuple[ResetCause, ...] = ("power_on", "reset", "brown_out")
    some = tuple(sorted(rng.sample(range(7), 5)))
    return [
        Session(f"boot after {cause}, servos {list(present)}", (Servos(present), BOOTED, *_gets()), cause)
        for cause in causes
        for present in (tuple(range(7)), some)
    ]


def homing(rng: random.Random) -> list[Session]:
    """Return three homings on request: with queued frames, without end stops, with a current limit to repair."""
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
    """Send every opcode with every edge value as channel and as value, and unknown opcodes."""
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
    """Run torque mode out of the window and back, with mode changes and heating."""
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
    """Send SET_ID on buses of 0, 1, 2 and 7 servos."""
    sessions = []
    for count in (0, 1, 2, 7):
        present = tuple(sorted(rng.sample(range(7), count)))
        steps: list[Step] = [SETTLED, Servos(present)]
        ids = [rng.choice((*present, 9)), rng.randrange(254), rng.choice((253, 254, 255))]
        for new in ids:
            data = frame(Opcode.SET_ID, rng.choice((new, new | 0x3000)), rng.choice((0, 500, 1023, 1024, 65535)))
            steps += [Send(data), Await(16, 3.5), _pause(rng)]
        sessions.append(Session(f"SET_ID with {count} servos", (*steps, *_gets())))
    # The requested ID belongs to a servo that is plugged in after the scan has passed this ID.
    early, late = sorted(rng.sample(range(7), 2))
    steps = [SETTLED, Servos((late,)), Send(frame(Opcode.SET_ID, early, 700)), Wait(1_000_000), Servos((early, late))]
    return [*sessions, Session("SET_ID of a number that appears", (*steps, Await(16, 3.5), *_gets()))]


def split(rng: random.Random) -> list[Session]:
    """Send split frames, slowly or in bursts beyond the queue size."""
    steps: list[Step] = [SETTLED]
    for _ in range(80):
        data = b"".join(_any_frame(rng) for _ in range(rng.choice((1, 1, 2, 5, 20))))
        while data:
            size = rng.choice((1, 5, 15, 16, 17, 100, 300))
            steps += [Send(data[:size]), _pause(rng)]
            data = data[size:]
    return [Session("split frames", tuple(steps))]


def garbage(rng: random.Random) -> list[Session]:
    """Send random bytes, excluding the slow opcodes."""
    steps: list[Step] = [SETTLED]
    for _ in range(150):
        data = rng.randbytes(rng.randrange(1, 40)).translate(None, bytes((Opcode.HOMING, Opcode.SET_ID)))
        steps += [Send(data), _pause(rng)]
    return [Session("garbage", (*steps, *_gets()))]


def damage(rng: random.Random) -> list[Session]:
    """Corrupt answers of the servos in every way, in every mode and during boot."""
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
    """Reset after settings and trims, with valid and invalid values in the storage."""
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
    """Send random frames, mostly in bursts that just fit the queue."""
    steps: list[Step] = [SETTLED]
    sent = 0
    while sent < 2000:
        count = rng.choice((1, 2, 4, 8, 16))
        steps += [Send(b"".join(_any_frame(rng) for _ in range(count))), _pause(rng)]
        sent += count
    return [Session("fuzz", (*steps, *_gets()))]


def calibrate_mid(rng: random.Random) -> list[Session]:
    """Send CALIBRATE_MID in both modes, for valid and invalid channels, with damaged answers, homing and resets."""

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


def sessions(name: str, seed: int) -> list[Session]:
    """Return the sessions of a name, determined by the seed."""
    return MAKERS[name](random.Random(f"{name} {seed}"))
