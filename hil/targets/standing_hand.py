"""An emulated hand in this process that stays while programs come and go, as a hand on a port does."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

from aero.clock import Clock
from hil.faults.schedule import Schedule
from hil.targets.emulated_hand import build_emulated, host_link
from hil.targets.hand_spec import HandSpec
from hil.targets.opening import Opening, first_reading, in_process
from hil.targets.target import Target
from model.units.plausible import unit_named


class StandingHand:
    """An emulated hand on virtual time, with its workbench; each `open` is another program at its port."""

    def __init__(self, spec: HandSpec) -> None:
        """Build the hand with its faults.

        Raises:
            ValueError: an unknown unit, or a fault that this hand cannot have.
        """
        self.spec, unit, schedule = spec, unit_named(spec.unit), Schedule(spec.faults, spec.seed)
        self.hand, self.workbench = build_emulated(unit, spec, schedule=schedule)
        self._opening = Opening(spec, unit, schedule)

    @property
    def clock(self) -> Clock:
        """The hand's time."""
        return self.hand.clock

    @contextmanager
    def open(self) -> Iterator[Target]:
        """Open the hand; it homes the first time, where it is one that has been homed.

        Raises:
            NoHandError: it does not answer.
        """
        opening = self._opening
        self._opening = replace(opening, spec=replace(opening.spec, homed=False))
        with in_process(opening, self.workbench, host_link(self.workbench)) as target:
            first_reading(target.hand, opening.delays, opening.spec.target)
            yield target

    def close(self) -> None:
        """End the hand."""
        self.hand.close()
