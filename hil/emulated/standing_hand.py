"""Emulated hand in this process that outlives the programs at its port, as a physical hand does."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

from aero.clock import Clock
from hil.emulated.any_hand import EmulatedOpening, in_process
from hil.emulated.emulated_hand import build_emulated, host_link
from hil.emulated.emulated_spec import EmulatedSpec
from hil.emulated.faults.schedule import Schedule
from hil.targets.opening import first_reading
from hil.targets.target import Target
from model.units.plausible import unit_named


class StandingHand:
    """Emulated hand on virtual time, with its workbench; each `open` stands for a new program at its port."""

    def __init__(self, spec: EmulatedSpec) -> None:
        """Build the hand with its faults.

        Raises:
            ValueError: an unknown unit, or a fault that cannot be injected into this hand.
        """
        self.spec, unit, schedule = spec, unit_named(spec.unit), Schedule(spec.faults, spec.seed)
        self.electronics, self.workbench = build_emulated(unit, spec, schedule=schedule)
        self._opening = EmulatedOpening(spec, unit=unit, schedule=schedule)

    @property
    def clock(self) -> Clock:
        """Clock of the hand."""
        return self.electronics.clock

    @contextmanager
    def open(self, *, may_be_silent: bool = False) -> Iterator[Target]:
        """Open the hand; the first call homes it if `spec.homed`.

        Raises:
            NoHandError: the hand does not answer, unless it may be silent.
        """
        opening = self._opening
        self._opening = replace(opening, spec=replace(opening.spec, homed=False))
        with in_process(opening, self.workbench, host_link(self.workbench)) as target:
            first_reading(target.hand, opening.delays, opening.spec.port, required=not may_be_silent)
            yield target

    def close(self) -> None:
        """Stop the emulation."""
        self.electronics.close()
