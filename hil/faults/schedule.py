"""Which faults were asked for, from which seed, and which of them have shown themselves."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from random import Random

from hil.faults.catalogue import CATALOGUE, checked
from hil.faults.fault import Fault, FaultLayer


class FaultNeverFiredError(Exception):
    """A fault was asked for and never had an effect: it begins after the end, or nothing came its way."""

    def __init__(self, faults: Iterable[object]) -> None:
        super().__init__(
            f"never fired: {', '.join(map(str, faults))}; let the run go on past the time at which it begins, "
            "and send or read what it acts on"
        )


class Schedule:
    """Faults that are injected into one hand.

    A fault has fired when it began; one that acts on bytes now and then, when it first changed some.
    """

    def __init__(self, faults: Iterable[Fault] = (), seed: int = 0) -> None:
        """Check the faults, alone and together.

        Raises:
            ValueError: an unknown or impossible fault, or two that cannot be combined.
        """
        self.faults = tuple(map(checked, faults))
        self._seed = seed
        self._fired: set[Fault] = set()
        rivals = Counter((CATALOGUE[fault.name].excludes or fault.name, fault.channel) for fault in self.faults)
        for fault in self.faults:
            word = CATALOGUE[fault.name].excludes or fault.name
            if rivals[word, fault.channel] > 1:
                both = [str(f) for f in self.faults if (CATALOGUE[f.name].excludes or f.name) == word]
                raise ValueError(f"these faults cannot be combined on one hand: {', '.join(both)}; leave one out")

    def of(self, *layers: FaultLayer) -> tuple[Fault, ...]:
        """Return the faults of some layers."""
        return tuple(fault for fault in self.faults if CATALOGUE[fault.name].layer in layers)

    def random(self, fault: Fault) -> Random:
        """Return the random numbers of one fault; the same seed gives the same ones."""
        return Random(f"{self._seed}/{fault}")

    def fire(self, fault: Fault) -> None:
        """Note that a fault had an effect."""
        self._fired.add(fault)

    def fired(self) -> frozenset[Fault]:
        """Return the faults that had an effect."""
        return frozenset(self._fired)

    def unfired(self) -> tuple[Fault, ...]:
        """Return the faults that had no effect so far."""
        return tuple(fault for fault in self.faults if fault not in self._fired)

    def require_all_fired(self) -> None:
        """Raise when a fault had no effect.

        Raises:
            FaultNeverFiredError: the message names it.
        """
        if unfired := self.unfired():
            raise FaultNeverFiredError(unfired)
