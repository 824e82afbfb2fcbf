"""Emulated hand of a case, with a helper that does the steps."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import Literal

from aero.channels import FINGERS, Channel
from aero.errors import AeroError
from aero.protocol import MAX_CODE
from aero.safety import SafetyStopError
from hil.emulated.any_hand import EmulatedOpening, in_process
from hil.emulated.emulated_hand import build_emulated, host_link
from hil.emulated.emulated_spec import EmulatedSpec
from hil.emulated.faults import parse_fault
from hil.emulated.faults.acts import act
from hil.emulated.faults.workbench import EMPTIED
from hil.recordings.recording import Header
from hil.targets.hand_errors import NoHandError
from hil.targets.hand_spec import PortSpec
from hil.targets.opening import first_reading
from hil.targets.target import Target
from hil.verdict.case import DiagnosisCase
from hil.verdict.case_file import HandOfCase
from hil.verdict.group import Proposal
from hil.verdict.noticed import Differences, Flashed, Noticed, Place, Removed, Voltages
from hil.verdict.part import Part
from hil.verdict.steps import StepOutcome
from model.units.plausible import unit_named

ASIDE = {"computer": (Part.COMPUTER, Part.DRIVER)}
"""Parts replaced temporarily during a step."""
ACTS: dict[str, Sequence[str]] = {
    "again": (),
    "home": ("power_off", "let_go", "power_on"),
    "power": ("power_off", "power_on"),
    "computer": (),
    "release": ("replace driver",),
    "cable": ("replace usb",),
    "plugs": ("power_off", "replace bus", "power_on"),
    "supply": ("power_off", "replace supply", "power_on"),
    "flash": ("flash",),
    "board": ("replace board",),
    "mend": ("power_off", "replace digit {at}", "power_on"),
    "exchange": ("exchange_servos {at} {beside}",),
}
"""Acts of each step, in the syntax of the prompt of `emulate`; empty for a step without a change."""
CLOSES_S, READS_S = 2.0, 0.05
"""Closing time of the fingers while the voltage is read, and reading period, s."""


class EmulatedCaseHand:
    """Emulated hand on virtual time with its workbench; changes persist until it is closed.

    Each `open` stands for a new program at the port of a physical hand.
    """

    def __init__(self, spec: EmulatedSpec) -> None:
        """Build the hand with its faults.

        Raises:
            ValueError: an unknown unit, or a fault that cannot be injected into this hand.
        """
        self.spec, self.helper = spec, self
        self._opening = EmulatedOpening(spec, unit=unit_named(spec.unit))
        self.electronics, self.workbench = build_emulated(self._opening.unit, spec)
        self.clock = self.electronics.clock

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

    def do(self, proposal: Proposal) -> str:
        """Do a step and return a description of the action; parts replaced for the step before are put back first."""
        self.workbench.put_back()
        name = proposal.step.name
        at, beside = ("" if one is None else one.label for one in (proposal.at, proposal.beside))
        said = [act(self.workbench, words.format(at=at, beside=beside)) for words in ACTS.get(name, ())]
        if parts := ASIDE.get(name):
            self.workbench.set_aside(*parts)
            said.append("took another computer with aero-hil as released")
        return "; ".join(said) or "left everything as it is"

    def see(self, proposal: Proposal) -> Noticed:
        """Look, measure or read as a step requires; return the observation."""
        bench = self.workbench
        bench.put_back()
        places = [one for one in (proposal.at, proposal.beside) if one is not None]
        looks: dict[str, Callable[[], Noticed]] = {
            "home": lambda: Removed(bench.let_go() == EMPTIED),
            "bend": lambda: Differences("bent", {one.label: bench.felt(one) for one in places}),
            "inspect": lambda: Differences("looked at", {one.label: bench.seen(one) for one in places}),
            "voltage": self._measure,
            "version": self._version,
            "registers": lambda: Differences("read", {"the bus": bench.on_bus()}),
        }
        return looks[proposal.step.name]()

    def marked(self, proposal: Proposal) -> Place:
        """Return the place of the servo that a step has marked."""
        return Place(proposal.beside)

    def moved(self, channel: Channel) -> Place:
        """Return the digit that moved when a channel was nudged."""
        return Place(channel)

    def redo(self, case: DiagnosisCase) -> None:
        """Repeat the completed steps of a case on the reopened hand."""
        for done in case.done:
            if StepOutcome.SKIPPED not in done.outcomes:
                self.do(done.proposal)

    def _measure(self) -> Voltages:
        bench, least = self.workbench, self.workbench.volts()
        rest = least
        with suppress(AeroError, OSError, SafetyStopError, NoHandError), self.open() as target:
            target.hand.command_codes([MAX_CODE if channel in FINGERS else 0 for channel in Channel])
            until = self.clock.now() + CLOSES_S
            while self.clock.now() < until:
                self.clock.sleep_until(self.clock.now() + READS_S)
                least = min(least, bench.volts())
        return Voltages(rest, least, bench.usual_volts)

    def _version(self) -> Flashed:
        assembly = self.workbench.assembly
        return Flashed(assembly.firmware, assembly.board_side, self.spec.firmware, self.spec.side)


def hand_after(case: DiagnosisCase, known: HandOfCase) -> EmulatedCaseHand:
    """Return the emulated hand of a case in its state after the last step.

    Raises:
        ValueError: the case is of a hand on a port, its unit is unknown, or a fault is.
    """
    if not known.emulated:
        raise ValueError("the case is of a hand on a port; give it with --hil")
    spec = emulated_hand(known)
    hand = EmulatedCaseHand(spec)
    hand.redo(case)
    return hand


def emulated_hand(hand: HandOfCase) -> EmulatedSpec:
    """Return the emulated hand that a case is about.

    Raises:
        ValueError: a fault is not known here.
    """
    side: Literal["left", "right"] = "left" if hand.side == "left" else "right"
    faults = tuple(map(parse_fault, hand.faults.split()))
    return EmulatedSpec(
        firmware=hand.firmware,
        side=side,
        unit=hand.unit,
        seed=hand.seed,
        homed=hand.zeros == "homed",
        faults=faults,
        firmware_program=Path(hand.firmware_program) if hand.firmware_program else None,
        baseline=Path(hand.baseline) if hand.baseline else None,
    )


def hand_of_case(header: Header, spec: PortSpec, baseline: Path | None) -> HandOfCase:
    """Return the hand of a case from a recording, and from the specification what a recording does not hold."""
    hand = replace(HandOfCase.of(header), baseline="" if baseline is None else str(baseline.absolute()))
    if not isinstance(spec, EmulatedSpec):
        return hand
    return replace(
        hand,
        unit=str(Path(spec.unit).absolute()) if spec.unit.endswith(".toml") else spec.unit,
        zeros="homed" if spec.homed else "ideal",
        firmware_program="" if spec.firmware_program is None else str(spec.firmware_program.absolute()),
    )
