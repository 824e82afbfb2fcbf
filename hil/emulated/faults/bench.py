"""Acts on an emulated hand, possibly in another process, and the acts that undo them."""

# The state of a hand is a list of acts on a healthy hand, because text passes a process boundary where an object
# cannot; one function then undoes acts in this process and behind a pseudo-terminal.

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass

from hil.emulated.faults.acts import act
from hil.emulated.faults.catalogue import parse_fault
from hil.emulated.faults.fault import Injection
from hil.emulated.faults.workbench import Workbench

UNDONE_BY = {
    "inject": "clear",
    "cable_off": "cable_on",
    "hold": "let_go",
    "power_off": "power_on",
    "supply_off": "supply_on",
}
"""Act to its inverse; an exchange is its own inverse."""
MOST_ACTS = 200
"""Limit of acts in one restoration; above it the hand counts as not restorable."""


@dataclass(frozen=True)
class BenchState:
    """State of an emulated hand on a bench."""

    acts: tuple[str, ...] = ()
    """Acts that bring a healthy hand into this state."""
    done: tuple[tuple[float, str], ...] = ()
    """Log of acts since the hand was opened: time, s on the hand's clock, and text."""
    faults: str = ""
    """Present, past momentary and scheduled faults as `parse_fault` reads them, separated by blanks."""

    @classmethod
    def of(cls, workbench: Workbench) -> BenchState:
        """Return the state of a hand in this process."""
        return cls(workbench.acts_present, tuple(workbench.done), workbench.words())

    @property
    def present(self) -> tuple[Injection, ...]:
        """Injections parsed from `faults`."""
        return tuple(map(parse_fault, self.faults.split()))


class HandBench(ABC):
    """Acts on an emulated hand, in this process or another."""

    @abstractmethod
    def act(self, words: str) -> str:
        """Perform an act given as text and return a sentence about it; raise ValueError if the hand refuses."""

    @abstractmethod
    def state(self) -> BenchState:
        """Return the present state."""

    def inject(self, fault: Injection | str) -> None:
        """Inject a fault; raise ValueError if the hand refuses."""
        self.act(f"inject {fault}")

    def clear(self, fault: Injection | str) -> None:
        """Clear a fault; raise ValueError if the hand does not have it or it cannot be undone."""
        self.act(f"clear {fault}")

    def present(self) -> tuple[Injection, ...]:
        """Return the present faults."""
        return self.state().present

    def restore(self, wanted: Sequence[str]) -> None:
        """Restore the state that the `wanted` acts produce on a healthy hand.

        Raises:
            ValueError: an act cannot be undone.
        """
        for _ in range(MOST_ACTS):
            if (words := next_act(self.state().acts, wanted)) is None:
                return
            self.act(words)
        raise ValueError(f"the hand's state cannot be restored: {', '.join(self.state().acts)}")


class BenchHere(HandBench):
    """Bench of a hand in this process; faults outside the catalogue, which no text names, pass as objects."""

    def __init__(self, workbench: Workbench) -> None:
        self.workbench = workbench

    def act(self, words: str) -> str:
        """Perform an act."""
        return act(self.workbench, words)

    def state(self) -> BenchState:
        """Return the present state."""
        return BenchState.of(self.workbench)

    def inject(self, fault: Injection | str) -> None:
        """Inject a fault."""
        self.workbench.inject(parse_fault(fault) if isinstance(fault, str) else fault)

    def clear(self, fault: Injection | str) -> None:
        """Clear a fault."""
        self.workbench.clear(parse_fault(fault) if isinstance(fault, str) else fault)

    def present(self) -> tuple[Injection, ...]:
        """Return the present faults."""
        return self.workbench.present


def next_act(present: Sequence[str], wanted: Sequence[str]) -> str | None:
    """Return the next act on the way from `present` to `wanted`, or None if both agree."""
    if "power_off" in present and "power_off" not in wanted:
        return "power_on"
    have, want = ([one for one in acts if one.startswith("exchange_")] for acts in (present, wanted))
    if have != want:
        return want[len(have)] if want[: len(have)] == have else have[-1]
    for one in present:
        if one not in wanted:
            name, _, rest = one.partition(" ")
            return f"{UNDONE_BY[name]} {rest}".strip()
    return next((one for one in wanted if one not in present), None)
