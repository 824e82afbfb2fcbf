"""The first thing in which two boards differ in a session, and what it did to the hand."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import zip_longest

from firmware_emulator.compare.run import SAMPLE_S, Contender, Stage, Trace
from firmware_emulator.compare.steps import Session

SHAFTS = ("index", "middle", "ring", "pinky", "thumb abduction", "thumb CMC", "thumb flexor")
SHOWN_BEFORE = 3
LONGEST_BYTES = 40

Event = tuple[int, bytes] | None


@dataclass(frozen=True)
class Difference:
    """Where two boards part."""

    where: str
    """`host`, `servo bus`, `storage` or `hand`."""
    at_ns: int
    """When."""
    before: tuple[tuple[int, bytes], ...]
    """The last events that are the same."""
    first: Event
    second: Event
    effects: tuple[str, ...]
    """What it did to the hand by the end of the session."""

    def lines(self, names: tuple[str, str]) -> list[str]:
        """Say it."""
        width = max(map(len, names))
        shown = [f"  both{'':{width - 4}} {_said(event)}" for event in self.before]
        shown += [
            f"  {name:{width}} {_said(event)}" for name, event in zip(names, (self.first, self.second), strict=True)
        ]
        effects = [f"  {effect}" for effect in self.effects] or ["  the hand ended alike"]
        return [f"first difference on the {self.where} at {self.at_ns / 1e6:.4f} ms:", *shown, *effects]


@dataclass(frozen=True)
class Comparison:
    """A session on two boards."""

    session: Session
    difference: Difference | None
    second: Trace
    """What the second board did."""
    packets: int
    replies: int
    """Bytes to the host."""
    hand_seconds: float


def compare(session: Session, first: Contender, second: Contender | Trace) -> Comparison:
    """Run a session on both, or on the first where the second was recorded, and look for the first difference."""
    a = Stage(first, session).run()
    b = second if isinstance(second, Trace) else Stage(second, session).run()
    replies = sum(len(data) for _, data in a.events["host"])
    return Comparison(session, _difference(a, b), b, a.packets, replies, len(a.angles) * SAMPLE_S)


def _difference(a: Trace, b: Trace) -> Difference | None:
    found = [part for where in a.events if (part := _part(where, a, b)) is not None]
    if found:
        return min(found, key=lambda difference: difference.at_ns)
    effects = _effects(a, b)
    return Difference("hand", 0, (), None, None, effects) if effects else None


def _part(where: str, a: Trace, b: Trace) -> Difference | None:
    first, second = a.events[where], b.events[where]
    if first == second:
        return None
    for at, (x, y) in enumerate(zip_longest(first, second)):
        if x != y:
            when = min(event[0] for event in (x, y) if event is not None)
            return Difference(where, when, tuple(first[max(at - SHOWN_BEFORE, 0) : at]), x, y, _effects(a, b))
    raise AssertionError("unequal lists without an unequal element")


def _effects(a: Trace, b: Trace) -> tuple[str, ...]:
    lines = []
    for shaft, name in enumerate(SHAFTS):
        apart = [abs(x[shaft] - y[shaft]) for x, y in zip(a.angles, b.angles, strict=False)]
        widest = max(apart, default=0.0)
        if widest > 0.0:
            lines.append(f"{name}: up to {widest:.3g} degrees apart, at {apart.index(widest) * SAMPLE_S:.2f} s")
    for servo, (x, y) in enumerate(zip(a.registers, b.registers, strict=True)):
        lines += [f"servo {servo}: {name} {x[name]} against {y[name]} at the end" for name in x if x[name] != y[name]]
    return tuple(lines)


def _said(event: Event) -> str:
    if event is None:
        return "nothing more"
    ns, data = event
    text = data[:LONGEST_BYTES].hex(" ") + (" ..." if len(data) > LONGEST_BYTES else "")
    return f"{ns / 1e6:12.4f} ms  {text}"
