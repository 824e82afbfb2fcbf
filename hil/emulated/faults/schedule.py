"""Requested faults of a hand, their random numbers, and the faults that have taken effect."""

from collections.abc import Hashable, Iterable
from random import Random

from hil.emulated.faults.fault import Injection
from hil.targets.hand_errors import FaultNeverFiredError


def refuse_rivals(faults: Iterable[Injection]) -> None:
    """Refuse faults that exclude each other.

    Raises:
        ValueError: two faults cannot be combined.
    """
    first: dict[object, Injection] = {}
    for fault in faults:
        if (other := first.setdefault(fault.rivals, fault)) is not fault:
            raise ValueError(f"these faults cannot be combined on one hand: {other}, {fault}; leave one out")


class Schedule:
    """Faults to be injected into one hand.

    A fault fires when it begins, a fault that acts on bytes when it first changes some.
    """

    def __init__(self, faults: Iterable[Injection] = (), seed: int = 0) -> None:
        """Store the faults after a check of their combination.

        Raises:
            ValueError: two faults cannot be combined.
        """
        self.faults = tuple(faults)
        self._seed = seed
        self._fired: set[Hashable] = set()
        refuse_rivals(self.faults)

    def random(self, fault: Hashable) -> Random:
        """Return the random generator of one fault, reproducible by the seed."""
        return Random(f"{self._seed}/{fault}")

    def fire(self, fault: Hashable) -> None:
        """Record that a fault had an effect."""
        self._fired.add(fault)

    def unfired(self) -> tuple[Injection, ...]:
        """Return the faults that had no effect so far."""
        return tuple(fault for fault in self.faults if fault not in self._fired)

    def require_all_fired(self) -> None:
        """Raise if a fault had no effect.

        Raises:
            FaultNeverFiredError: the message names the faults.
        """
        if unfired := self.unfired():
            raise FaultNeverFiredError(unfired)
