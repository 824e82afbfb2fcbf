"""Acts on an emulated hand that somebody else may hold, and the acts that undo them.

The state of a hand is the list of acts that would bring a whole hand there, so that a process behind a pseudo-terminal
can tell it, and one function undoes it everywhere.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from hil.faults.acts import act
from hil.faults.catalogue import parse_fault
from hil.faults.fault import Injection
from hil.faults.workbench import Workbench

UNDONE_BY = {"inject": "clear", "cable_off": "cable_on", "hold": "let_go", "power_off": "power_on"}
"""Act to the one that undoes it; an exchange undoes itself."""
MOST_ACTS = 200
"""Limit of acts in one restoration; a hand that needs more is not restorable."""


@dataclass(frozen=True)
class BenchState:
    """State of an emulated hand on a bench."""

    acts: tuple[str, ...] = ()
    """Acts that bring a whole hand into this state."""
    done: tuple[tuple[float, str], ...] = ()
    """Everything that was done since the hand was opened, and when, s on its clock."""
    faults: str = ""
    """Texts of the faults that the hand has, had at an instant, or will have, with blanks between."""

    @classmethod
    def of(cls, workbench: Workbench) -> BenchState:
        """Return the state of a hand in this process."""
        return cls(workbench.acts_present, tuple(workbench.done), workbench.words())

    @property
    def present(self) -> tuple[Injection, ...]:
        """The faults."""
        return tuple(map(parse_fault, self.faults.split()))


@dataclass(frozen=True)
class HandBench:
    """Capability: an emulated hand, in this process or behind a pseudo-terminal, to which acts are done."""

    act: Callable[[str], str]
    """Does an act in words and returns the sentence about it; raises ValueError where it cannot be done."""
    state: Callable[[], BenchState]

    @classmethod
    def of(cls, workbench: Workbench) -> HandBench:
        """Return the bench of a hand in this process."""
        return cls(lambda words: act(workbench, words), lambda: BenchState.of(workbench))

    def restore(self, wanted: Sequence[str]) -> None:
        """Bring the hand into the state that these acts would bring a whole hand into.

        Raises:
            ValueError: an act cannot be undone.
        """
        for _ in range(MOST_ACTS):
            if (words := next_act(self.state().acts, wanted)) is None:
                return
            self.act(words)
        raise ValueError(f"the hand does not become what it was: {', '.join(self.state().acts)}")


def next_act(present: Sequence[str], wanted: Sequence[str]) -> str | None:
    """Return the act to do next, so that `present` becomes `wanted`; None where they agree."""
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
