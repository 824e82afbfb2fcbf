"""An emulated owner: does the steps of a case on an emulated hand, and answers from what is there."""

from collections.abc import Sequence
from dataclasses import dataclass
from time import perf_counter

from aero.channels import Channel
from aero.errors import AeroError
from firmware_emulator.servo.registers import REGISTERS
from hil.faults import FaultNeverFiredError
from hil.faults.fault import FaultLayer, Injection
from hil.faults.part import Part
from hil.faults.servo import servo_of
from hil.faults.winding import NEIGHBOUR
from hil.faults.workbench import Workbench
from hil.targets.opening import open_target
from hil.verdict.case import DiagnosisCase
from hil.verdict.parts import Suspect
from hil.verdict.rerun import rerun
from hil.verdict.steps import StepOutcome
from hil.verdict.validation import validate
from model.geometry import Side

ACTS = {
    "power": ("power_off", "power_on"),
    "home": ("let_go",),
    "computer": ("replace computer",),
    "cable": ("replace usb",),
    "plugs": ("replace bus",),
    "flash": ("replace board",),
    "exchange": ("exchange_servos {at} {beside}",),
}
"""What an owner does for a step, as the prompt of `emulate` takes it."""
STARTS_S = 90
"""For how long the owner waits after power returned, s."""


@dataclass(frozen=True)
class Played:
    """A case that was played to its end."""

    faults: tuple[Injection, ...]
    found: bool
    """Whether the validation failed."""
    case: DiagnosisCase | None = None
    outcomes: tuple[str, ...] = ()
    passed_on_the_broken_hand: bool = False
    seconds: float = 0.0

    @property
    def minutes(self) -> float:
        return sum(done.proposal.step.minutes for done in self.case.done) if self.case else 0.0

    @property
    def right(self) -> bool:
        """Whether the convicted part is that of a fault, on its channel or one that it is about."""
        convicted = None if self.case is None else self.case.convicted
        return convicted is not None and any(is_right(convicted, fault) for fault in self.faults)


def is_right(suspect: Suspect, fault: Injection) -> bool:
    """Return whether a suspect is the part of a fault."""
    return suspect.part in fault.parts and (suspect.channel in {None, *_about(fault)} or fault.channel is None)


def _about(fault: Injection) -> set[Channel | None]:
    """Return the channels that a fault is about."""
    two = fault.fault.layer in (FaultLayer.WINDING, FaultLayer.SERVO) and fault.channel is not None
    return {fault.channel, NEIGHBOUR.get(fault.channel)} if two else {fault.channel}


def _felt(fault: Injection, at: Channel) -> bool:
    """Return whether a person who bends a digit and looks at it finds a fault; a small one is missed."""
    sizes = sorted(map(abs, fault.fault.steps()))
    return (
        fault.part is Part.DIGIT
        and at in _about(fault)
        and (fault.fault.severity is None or abs(fault.severity) >= sizes[len(sizes) // 2])
    )


class Owner:
    """Does what a step says."""

    def __init__(self, target):
        self.target = target
        self.bench = target.get(Workbench)

    def does(self, proposal):
        """Do a step; return the answer where it asks, None where what shows the failure is to be run."""
        name = proposal.step.name
        if proposal.step.asks:
            seen = {
                "voltage": self._sees_low,
                "version": self._sees_version,
                "registers": self._sees_registers,
                "by_hand": lambda: any(_felt(fault, proposal.at) for fault in self.bench.present),
            }[name]
            return StepOutcome.SEEN if seen() else StepOutcome.STAYS
        for words in ACTS.get(name, ()):
            at, beside = ("" if one is None else one.label for one in (proposal.at, proposal.beside))
            self.target.act(words.format(at=at, beside=beside))
        if name in ACTS and name != "home":
            self._wait()
        return None

    def _wait(self):
        """Wait until the board answers again: it may home for up to 45 s after power returned."""
        clock = self.target.clock
        for _ in range(STARTS_S):
            clock.sleep_until(clock.now() + 1.0)
            try:
                self.target.hand.read_codes()
            except (AeroError, OSError):
                continue
            break

    def _sees_low(self):
        return any(fault.part is Part.SUPPLY for fault in self.bench.present)

    def _sees_version(self):
        return any(fault.fault.layer is FaultLayer.FIRMWARE for fault in self.bench.present)

    def _sees_registers(self):
        """Return whether an ID is there twice, or one servo has another register than all others have."""
        servos = [servo_of(self.bench.hand, channel) for channel in Channel]
        return len({servo.memory.get("id") for servo in servos}) < len(servos) or _differ(servos)


def _differ(servos):
    names = [name for name in REGISTERS if name not in ("id", "position_offset")]
    for name in names:
        values = [servo.memory.get(name) for servo in servos]
        if any(values.count(value) == 1 and values.count(max(set(values), key=values.count)) >= 5 for value in values):
            return True
    return False


def play(faults: Sequence[Injection], unit: str, seed: int, firmware: str, hand: Side) -> Played:
    """Play one case: validate, then step by step until it ends."""
    start = perf_counter()
    case, found, outcomes = None, False, list[str]()
    broken = False
    try:
        with open_target(unit=unit, seed=seed, firmware=firmware, hand=hand, homed=True, faults=faults) as target:
            run = validate(target)
            found = not run.passed
            case = run.diagnosis.case
            owner = Owner(target)
            while case is not None and (proposal := case.next_step) is not None:
                outcome = owner.does(proposal)
                if outcome is None:
                    outcome, after = rerun(target, case, proposal)
                    if outcome is None:
                        break
                    broken |= proposal.step.name == "again" and after.passed
                case = case.after(proposal, outcome)
    except (FaultNeverFiredError, AeroError, OSError) as error:
        outcomes.append(type(error).__name__)
    return Played(tuple(faults), found, case, tuple(outcomes), broken, perf_counter() - start)
