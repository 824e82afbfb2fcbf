"""Faults of the host link: what becomes of bytes on their way, as pure functions of time and chance.

A board writes a reply in one piece of 16 bytes, and a driver writes a command in one; faults act on such pieces.
`LinkFaults` knows nothing of ports: the emulated hand and the proxy both ask it what to send when.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from random import Random
from typing import Literal

from hil.faults.fault import ONCE, SHARE, SWITCH, Fault, Kind

Direction = Literal["to_hand", "from_hand"]
Pieces = list[tuple[float, bytes]]
"""Delays, s, and bytes."""
Act = Callable[[bytes, float, Random, float], Pieces]
"""What becomes of a piece, given the severity, and the time, s."""

APART_S = 0.02
"""How much later the second part of a piece that was cut comes, s."""
OVERTAKEN_S = 0.05
"""By how much a piece is late that the next ones overtake, s."""
BITS = 10
"""Bits that one byte takes on a serial line, start and stop included."""
BOOT_TEXT = b"ESP-ROM:esp32s3-20210327\r\nBuild:Mar 27 2021\r\nrst:0x1 (POWERON),boot:0x8\r\n"
"""What an ESP32-S3 says before its firmware does."""
MEASUREMENTS = range(0x22, 0x26)


def _sometimes(change: Callable[[bytes, Random], Pieces]) -> Act:
    """Let a change happen to a share of the pieces."""
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
    """A share of the replies repeat the last one of their opcode."""

    def __init__(self) -> None:
        self._last: dict[int, bytes] = {}

    def __call__(self, data: bytes, share: float, random: Random, now: float) -> Pieces:
        """Return the reply, or the one before."""
        if data[0] not in self._last or random.random() >= share:
            self._last[data[0]] = data
        return [(0.0, self._last[data[0]])]


def _same(act: Act) -> Callable[[], Act]:
    return lambda: act


BOTH: dict[str, tuple[str, str, str, tuple[float, float, float], Act]] = {
    "truncated": ("A19", "lose their end", "replies_lose_bytes", (0.01, 0.05, 0.3), _sometimes(_truncated)),
    "lost": ("A1", "are lost", "exchanges_lost", (0.01, 0.05, 0.3), _sometimes(lambda data, random: [])),
    "byte_dropped": ("A1", "lose a byte", "replies_lose_bytes", (0.01, 0.05, 0.3), _sometimes(_byte_dropped)),
    "byte_doubled": ("A3", "have a byte twice", "replies_gain_bytes", (0.01, 0.05, 0.3), _sometimes(_byte_doubled)),
    "byte_inserted": ("A4", "have a byte more", "replies_gain_bytes", (0.01, 0.05, 0.3), _sometimes(_byte_inserted)),
    "bit_flipped": ("A2", "have a wrong bit", "replies_alter_bytes", (0.01, 0.05, 0.3), _sometimes(_bit_flipped)),
    "doubled": (
        "A15",
        "come twice",
        "replies_gain_bytes",
        (0.01, 0.05, 0.3),
        _sometimes(lambda data, random: [(0.0, data + data)]),
    ),
}
"""Faults of both directions: row of the list, what happens, cause when it happens to replies, severities, how.

Of commands all is `commands_damaged`, but that nobody can see whether a request or its reply was lost.
"""
WAYS: tuple[tuple[str, str], ...] = (("reply", "replies"), ("command", "commands"))

KINDS = (
    *(
        Kind(
            f"{way}_{name}",
            "link",
            (row,),
            f"of {plural}",
            severities,
            f"{plural} {words}",
            cause=cause if way == "reply" or name == "lost" else "commands_damaged",
            bounds=SHARE,
        )
        for way, plural in WAYS
        for name, (row, words, cause, severities, _) in BOTH.items()
    ),
    Kind("reply_delayed", "link", ("A8", "A13"), "ms at most", (5, 30, 400), "replies come late", cause="late"),
    Kind("command_delayed", "link", ("A8", "B3", "D5"), "ms at most", (5, 30, 400), "commands come late", cause="late"),
    Kind(
        "usb_timer",
        "link",
        ("A8", "A7"),
        "ms",
        (4, 16, 50),
        "a USB adapter hands replies over on a timer",
        cause="late",
    ),
    Kind(
        "reply_stale", "link", ("A13", "B11"), "of replies", (0.05, 0.2, 0.6), "replies repeat older ones", bounds=SHARE
    ),
    Kind(
        "reply_cut",
        "link",
        ("A6",),
        "of replies",
        (0.05, 0.2, 0.6),
        "replies come in two pieces",
        cause="late",
        bounds=SHARE,
    ),
    Kind(
        "reply_reordered",
        "link",
        ("A13",),
        "of replies",
        (0.01, 0.05, 0.3),
        "replies overtake each other",
        bounds=SHARE,
    ),
    Kind(
        "reply_other_opcode",
        "link",
        ("A14",),
        "of replies",
        (0.01, 0.05, 0.3),
        "replies have another opcode",
        cause="replies_alter_bytes",
        bounds=SHARE,
    ),
    Kind(
        "reply_junk",
        "link",
        ("A4", "A15"),
        "of replies",
        (0.01, 0.05, 0.3),
        "junk comes before replies",
        cause="replies_gain_bytes",
        bounds=SHARE,
    ),
    Kind(
        "link_slow", "link", ("A9", "A6"), "baud", (115200, 38400, 9600), "bytes of replies trickle", bounds=(300, 1e7)
    ),
    Kind("link_silent", "link", ("A10",), "s", (0.2, 1, 30), "nothing comes back for a while", at_s=5.0),
    Kind("boot_text", "link", ("A5",), "", SWITCH, "a boot text comes in between", bounds=ONCE, at_s=40.0),
    Kind("link_hangs_up", "link", ("A11",), "", SWITCH, "the port is gone", bounds=ONCE, at_s=5.0),
)
ACTS: dict[str, Callable[[], Act]] = {
    **{f"{way}_{name}": _same(act) for way, _ in WAYS for name, (*_, act) in BOTH.items()},
    "reply_delayed": _same(_delayed),
    "command_delayed": _same(_delayed),
    "usb_timer": _same(_on_timer),
    "reply_stale": Stale,
    "reply_cut": _same(_sometimes(_cut)),
    "reply_reordered": _same(_sometimes(lambda data, random: [(OVERTAKEN_S, data)])),
    "reply_other_opcode": _same(_sometimes(_other_opcode)),
    "reply_junk": _same(_sometimes(_junk)),
    "link_slow": _same(_bandwidth),
}
"""Makes what acts on every piece; the others are events in time."""
OVERTAKING = {"reply_reordered"}


class LinkFaults:
    """What becomes of the bytes of one link."""

    def __init__(
        self,
        faults: Sequence[Fault],
        *,
        start_s: float,
        random: Callable[[Fault], Random],
        fired: Callable[[Fault], None],
    ) -> None:
        """Begin at `start_s`, s on the clock whose times `passed` is given."""
        self._start_s = start_s
        self._fired = fired
        self._acts = [(fault, ACTS[fault.name](), random(fault)) for fault in faults if fault.name in ACTS]
        self._events = [fault for fault in faults if fault.name not in ACTS]
        self._free_at = {"to_hand": start_s, "from_hand": start_s}
        self._gone = False

    def passed(self, direction: Direction, now: float, data: bytes) -> Pieces:
        """Return what of `data`, handed over at `now` (s), comes out when (s), in order."""
        if not data or (direction == "from_hand" and self._silent(now)):
            return []
        pieces, late = [(0.0, data)], False
        for fault, act, random in self._acts:
            if _direction(fault) != direction or now < self._start_s + fault.at_s:
                continue
            before, pieces = pieces, []
            for delay, piece in before:
                pieces += [(delay + more, part) for more, part in act(piece, fault.severity, random, now) if part]
            if pieces != before:
                self._fired(fault)
                late |= fault.name in OVERTAKING
        return [(self._in_turn(direction, now + delay, late), part) for delay, part in pieces]

    def inserted(self, now: float) -> bytes:
        """Return what came from nowhere since the last call."""
        due = [fault for fault in self._events if fault.name == "boot_text" and now >= self._start_s + fault.at_s]
        for fault in due:
            self._events.remove(fault)
            self._fired(fault)
        return BOOT_TEXT * len(due)

    def gone(self, now: float) -> bool:
        """Return whether the port is gone."""
        for fault in self._events:
            if fault.name == "link_hangs_up" and now >= self._start_s + fault.at_s:
                self._fired(fault)
                self._gone = True
        return self._gone

    def times(self) -> list[float]:
        """Return the times (s) of all that happens without a byte being sent."""
        return [self._start_s + fault.at_s for fault in self._events]

    def _in_turn(self, direction: Direction, t: float, overtaken: bool) -> float:
        if overtaken:
            return t
        self._free_at[direction] = max(self._free_at[direction], t)
        return self._free_at[direction]

    def _silent(self, now: float) -> bool:
        for fault in self._events:
            begun = now - self._start_s - fault.at_s
            if fault.name == "link_silent" and 0.0 <= begun < fault.severity:
                self._fired(fault)
                return True
        return False


def _direction(fault: Fault) -> Direction:
    return "to_hand" if fault.name.startswith("command_") else "from_hand"
