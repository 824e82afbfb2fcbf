"""Faults of the host link: loss, damage, delay and reordering of bytes."""

from collections.abc import Callable, Hashable
from dataclasses import dataclass
from random import Random
from typing import Protocol

from firmware_emulator.bus import BITS
from hil.emulated.faults.assembly import Active
from hil.emulated.faults.fault import Fault, FaultLayer, Injection, Severity, share
from hil.emulated.faults.link_faults import LinkEffect, LinkFaults, Pieces
from hil.targets.wire_log import Direction
from hil.verdict.part import Part

Act = Callable[[bytes, float, Random, float], Pieces]
"""Maps a piece, a severity, random numbers and a time, s, to the pieces to be sent."""

APART_S = 0.02
"""Delay of the second part of a cut piece, s."""
OVERTAKEN_S = 0.05
"""Delay of a piece to be overtaken, s."""
BOOT_TEXT = b"ESP-ROM:esp32s3-20210327\r\nBuild:Mar 27 2021\r\nrst:0x1 (POWERON),boot:0x8\r\n"
"""Boot text of an ESP32-S3 ROM."""
MEASUREMENTS = range(0x22, 0x26)


def _sometimes(change: Callable[[bytes, Random], Pieces]) -> Act:
    """Apply a change to a random fraction of the pieces, set by the severity."""
    return lambda data, share, random, now: change(data, random) if random.random() < share else [(0.0, data)]


def _byte_dropped(data: bytes, random: Random) -> Pieces:
    at = random.randrange(len(data))
    return [(0.0, data[:at] + data[at + 1 :])]


def _truncated(data: bytes, random: Random) -> Pieces:
    return [(0.0, data[: random.randrange(len(data))])]


def _byte_doubled(data: bytes, random: Random) -> Pieces:
    at = random.randrange(len(data))
    return [(0.0, data[: at + 1] + data[at:])]


def _byte_inserted(data: bytes, random: Random) -> Pieces:
    at = random.randrange(len(data) + 1)
    return [(0.0, data[:at] + random.randbytes(1) + data[at:])]


def _bit_flipped(data: bytes, random: Random) -> Pieces:
    bit = random.randrange(8 * len(data))
    changed = bytearray(data)
    changed[bit // 8] ^= 1 << bit % 8
    return [(0.0, bytes(changed))]


def _cut(data: bytes, random: Random) -> Pieces:
    at = random.randrange(1, len(data)) if len(data) > 1 else 0
    return [(0.0, data[:at]), (APART_S, data[at:])]


def _junk(data: bytes, random: Random) -> Pieces:
    return [(0.0, random.randbytes(random.randrange(1, 40)) + data)]


def _other_opcode(data: bytes, random: Random) -> Pieces:
    return [(0.0, bytes((random.choice([code for code in MEASUREMENTS if code != data[0]]),)) + data[1:])]


def _delayed(data: bytes, milliseconds: float, random: Random, now: float) -> Pieces:
    return [(random.uniform(0.0, milliseconds / 1000.0), data)]


def _on_timer(data: bytes, milliseconds: float, random: Random, now: float) -> Pieces:
    period = milliseconds / 1000.0
    return [(period - now % period if period else 0.0, data)]


def _bandwidth(data: bytes, bauds: float, random: Random, now: float) -> Pieces:
    return [((at + 1) * BITS / bauds, data[at : at + 1]) for at in range(len(data))]


class Stale:
    """Repetition of the last reply of an opcode, for a random fraction of the replies."""

    def __init__(self) -> None:
        self._last: dict[int, bytes] = {}

    def __call__(self, data: bytes, share: float, random: Random, now: float) -> Pieces:
        """Return the reply or, at random, the previous reply with its opcode."""
        if data[0] not in self._last or random.random() >= share:
            self._last[data[0]] = data
        return [(0.0, self._last[data[0]])]


class LinkSide(Protocol):
    """Injection point of link faults: the assembly of an emulated hand, or a proxy before any hand."""

    link: LinkFaults

    def now(self) -> float:
        """Return the time, s."""
        ...

    def random(self, fault: Hashable) -> Random:
        """Return the random generator of one injection."""
        ...


Put = Callable[[LinkSide, Injection], Active]


@dataclass(frozen=True)
class LinkFault(Fault):
    """Fault of a link, injectable before a physical hand too."""

    put: Put = lambda side, fault: Active(lambda: None)
    """Injector for any link; `inject` is for emulated hands."""


def _begun(make: Callable[[LinkSide, Injection], LinkEffect]) -> Put:
    return lambda side, fault: Active(lambda: side.link.add(make(side, fault)), lambda: side.link.remove(fault))


def _fault(
    name: str,
    part: Part,
    words: str,
    put: Put,
    severity: Severity | None = None,
    *,
    at_s: float = 0.0,
    alike: tuple[Part, ...] = (),
    layer: FaultLayer = FaultLayer.LINK,
) -> LinkFault:
    return LinkFault(name, layer, part, words, put, severity=severity, at_s=at_s, alike=alike, put=put)


def _passing(act: Act, direction: Direction = "from_hand", *, overtakes: bool = False) -> Put:
    """Return an injector of a change to every piece of one direction."""

    def make(side: LinkSide, fault: Injection) -> LinkEffect:
        random = side.random(fault)
        return LinkEffect(
            fault, direction, lambda data, now: act(data, fault.severity, random, now), overtakes=overtakes
        )

    return _begun(make)


def _stale(side: LinkSide, fault: Injection) -> Active:
    return _passing(Stale())(side, fault)


def _lost(data: bytes, random: Random) -> Pieces:
    return []


def _doubled(data: bytes, random: Random) -> Pieces:
    return [(0.0, data + data)]


def _late(data: bytes, random: Random) -> Pieces:
    return [(OVERTAKEN_S, data)]


BOTH: dict[str, tuple[str, Act]] = {
    "truncated": ("lose their end", _sometimes(_truncated)),
    "lost": ("are lost", _sometimes(_lost)),
    "byte_dropped": ("lose a byte", _sometimes(_byte_dropped)),
    "byte_doubled": ("have a byte twice", _sometimes(_byte_doubled)),
    "byte_inserted": ("have a byte more", _sometimes(_byte_inserted)),
    "bit_flipped": ("have a wrong bit", _sometimes(_bit_flipped)),
    "doubled": ("come twice", _sometimes(_doubled)),
}
"""Faults of both directions, by name: description for display, and change."""
WAYS: tuple[tuple[str, str, Direction], ...] = (("reply", "replies", "from_hand"), ("command", "commands", "to_hand"))
SOME = (0.01, 0.05, 0.3)
OFTEN = (0.05, 0.2, 0.6)
# fmt: off
FAULTS = (
    *(
        _fault(f"{way}_{name}", Part.USB, f"{plural} {words}", _passing(act, direction), share(plural, *SOME))
        for way, plural, direction in WAYS
        for name, (words, act) in BOTH.items()
    ),
    _fault("reply_delayed", Part.USB, "delayed replies",
           _passing(_delayed), Severity("ms at most", (5, 30, 400), 0, 60_000), alike=(Part.COMPUTER,)),
    _fault("command_delayed", Part.USB, "delayed commands",
           _passing(_delayed, "to_hand"), Severity("ms at most", (5, 30, 400), 0, 60_000), alike=(Part.COMPUTER,)),
    _fault("usb_timer", Part.USB, "latency timer of the USB adapter",
           _passing(_on_timer), Severity("ms", (4, 16, 50), 0, 10_000), alike=(Part.COMPUTER,)),
    _fault("reply_stale", Part.BOARD, "replies repeat older ones",
           _stale, share("replies", *OFTEN), alike=(Part.USB, Part.BUS)),
    _fault("reply_cut", Part.USB, "split replies",
           _passing(_sometimes(_cut)), share("replies", *OFTEN), alike=(Part.COMPUTER,)),
    _fault("reply_reordered", Part.USB, "reordered replies",
           _passing(_sometimes(_late), overtakes=True), share("replies", *SOME), alike=(Part.COMPUTER,)),
    _fault("reply_other_opcode", Part.USB, "replies have another opcode",
           _passing(_sometimes(_other_opcode)), share("replies", *SOME), alike=(Part.BOARD,)),
    _fault("reply_junk", Part.USB, "stray bytes before replies",
           _passing(_sometimes(_junk)), share("replies", *SOME)),
    _fault("link_slow", Part.USB, "slow byte stream",
           _passing(_bandwidth), Severity("baud", (115200, 38400, 9600), 300, 1e7), alike=(Part.COMPUTER,)),
    _fault("link_silent", Part.USB, "silent link",
           _begun(lambda side, fault: LinkEffect(fault, silent_until=side.now() + fault.severity)),
           Severity("s", (0.2, 1, 30), 0, 3600), at_s=5.0, alike=(Part.BOARD, Part.COMPUTER)),
    _fault("boot_text", Part.BOARD, "boot text between replies",
           _begun(lambda side, fault: LinkEffect(fault, inserts=BOOT_TEXT)),
           at_s=40.0, alike=(Part.USB, Part.SUPPLY)),
    _fault("link_hangs_up", Part.USB, "the port is gone",
           _begun(lambda side, fault: LinkEffect(fault, is_gone=True)),
           at_s=5.0, alike=(Part.COMPUTER, Part.BOARD), layer=FaultLayer.HOST),
)
# fmt: on
