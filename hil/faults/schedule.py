"""Which faults were asked for, from which seed, and which of them have shown themselves."""

from __future__ import annotations

from collections.abc import Hashable, Iterable
from random import Random

from aero.exit_code import Exit
from hil.faults.fault import Injection


class FaultNeverFiredError(Exception):
    """A fault was asked for and never had an effect: it begins after the end, or nothing came its way."""

    exit_code = Exit.USAGE

    def __init__(self, faults: Iterable[object]) -> None:
        super().__init__(
            f"never fired: {', '.join(map(str, faults))}; let the run go on past the time at which it begins, "
            "and send or read what it acts on"
        )


def refuse_rivals(faults: Iterable[Injection]) -> None:
    """Refuse faults that cannot be in one hand.

    Raises:
        ValueError: two cannot be combined.
    """
    first: dict[object, Injection] = {}
    for fault in faults:
        if (other := first.setdefault(fault.rivals, fault)) is not fault:
            raise ValueError(f"these faults cannot be combined on one hand: {other}, {fault}; leave one out")


class Schedule:
    """Faults that are injected into one hand.

    A fault has fired when it began; one that acts on bytes now and then, when it first changed some.
    """

    def __init__(self, faults: Iterable[Injection] = (), seed: int = 0) -> None:
        """Check the faults together.

        Raises:
            ValueError: two cannot be combined.
        """
        self.faults = tuple(faults)
        self._seed = seed
        self._fired: set[Hashable] = set()
        refuse_rivals(self.faults)

    def random(self, fault: Hashable) -> Random:
        """Return the random numbers of one fault; the same seed gives the same ones."""
        return Random(f"{self._seed}/{fault}")

    def fire(self, fault: Hashable) -> None:
        """Note that a fault had an effect."""
        self._fired.add(fault)

    def unfired(self) -> tuple[Injection, ...]:
        """Return the faults that had no effect so far."""
        return tuple(fault for fault in self.faults if fault not in self._fired)

    def require_all_fired(self) -> None:
        """Raise when a fault had no effect.

        Raises:
            FaultNeverFiredError: the message names it.
        """
        if unfired := self.unfired():
            raise FaultNeverFiredError(unfired)
