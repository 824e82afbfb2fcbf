"""An emulated owner: does the steps of a case on an emulated hand, and answers from what is there."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from time import perf_counter

from aero.channels import Channel
from aero.errors import AeroError
from firmware_emulator.servo.models import REGISTERS
from hil.faults import FaultNeverFiredError
from hil.faults.fault import FaultLayer, Injection, Part
from hil.faults.mechanics import JOINTS
from hil.faults.servo import servo_of
from hil.faults.winding import NEIGHBOUR
from hil.faults.workbench import Workbench
from hil.targets.opening import open_target
from hil.verdict.case import DiagnosisCase
from hil.verdict.parts import Suspect
from hil.verdict.rerun import rerun
from hil.verdict.run_end import EndKind
from hil.verdict.steps import StepOutcome
from hil.verdict.validation import validate
from model.geometry import Side

ACTS = {
    "power": ("power_off", "power_on"),
    "home": ("let_go",),
    "look": ("let_go",),
    "release": ("replace driver",),
    "cable": ("replace usb",),
    "exchange": ("exchange_servos {at} {beside}",),
}
"""What an owner does for a step, as the prompt of `emulate` takes it."""
REPLACED = {"flash": "board", "supply": "bus"}
"""What is replaced where the answer was no."""
WAITS = {"again", "power", "computer", "release", "cable", "supply", "flash", "exchange"}
"""Steps after which the board is given the time that a person takes, as where it starts anew or homes by itself."""
CLOSED, CLOSING_S = 65535, 2
"""The code of a closed channel, and how long the owner watches the voltmeter while the hand closes, s."""
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
    busy: bool = False
    """Whether the validation said that its computer was held up, which no step need show."""

    @property
    def convicted(self) -> Suspect | None:
        """The part that the owner is told."""
        return Suspect(Part.COMPUTER) if self.busy else None if self.case is None else self.case.convicted

    @property
    def minutes(self) -> float:
        return sum(done.proposal.step.minutes for done in self.case.done) if self.case else 0.0

    @property
    def gone_by_itself(self) -> bool:
        """Whether the failure did not come again, so that nothing could be convicted."""
        case = self.case
        return case is not None and case.gone and [one.proposal.step.name for one in case.done] == ["again"]

    @property
    def right(self) -> bool:
        """Whether the convicted part is that of a fault, on its channel or one that it is about."""
        told = self.convicted
        return told is not None and any(is_right(told, fault) for fault in self.faults)


def is_right(suspect: Suspect, fault: Injection) -> bool:
    """Return whether a suspect is the part of a fault."""
    return suspect.part in fault.parts and (suspect.channel in {None, *_about(fault)} or fault.channel is None)


def _about(fault: Injection) -> set[Channel | None]:
    """Return the channels that a fault is about."""
    two = fault.fault.layer in (FaultLayer.WINDING, FaultLayer.SERVO) and fault.channel is not None
    return {fault.channel, NEIGHBOUR.get(fault.channel)} if two else {fault.channel}


NOTICED = {
    "joint_friction": lambda is_, was: is_ > was + 0.04,
    "spring_open": lambda is_, was: abs(is_ - was) > 0.35 * was,
    "closed_stop": lambda is_, was: abs(is_ - was) > 0.12,
    "cable_take_up": lambda is_, was: abs(is_ - was) > 4e-3,
}
"""What a person notices of a digit that is bent and looked at: friction, springs, stops, rad, and a slack cable, m."""


class Owner:
    """Does what a step says."""

    def __init__(self, target):
        self.target = target
        self.bench = target.get(Workbench)
        self.freed = False
        self._set_aside = ()

    def does(self, proposal):
        """Do a step; return the answer where it asks, None where what shows the failure is to be run."""
        step = proposal.step
        touching = self._touching()
        if step.name == "computer":
            self._set_aside = [one for one in self.bench.present if one.part in (Part.COMPUTER, Part.DRIVER)]
            for fault in self._set_aside:
                self.bench._take(fault)
        for words in ACTS.get(step.name, ()):
            at, beside = ("" if one is None else one.label for one in (proposal.at, proposal.beside))
            self.target.act(words.format(at=at, beside=beside))
        self.freed = step.frees and self._touching() != touching
        if step.asks and self._sees(step.name, proposal.at):
            return StepOutcome.SEEN
        if step.name in REPLACED:
            self.target.act(f"replace {REPLACED[step.name]}")
        if step.name in WAITS:
            self._wait()
        return None if step.runs else StepOutcome.STAYS

    def puts_back(self):
        """Put back what was set aside for a step."""
        for fault in self._set_aside:
            self.bench._put(fault)
        self._set_aside = ()

    def _touching(self):
        return self.bench.present, self.bench._held

    def _sees(self, name, at):
        return {
            "look": lambda: self._notices(at),
            "supply": self._measures_off,
            "flash": self._reads_another_version,
            "registers": self._reads_other_registers,
        }[name]()

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

    def _notices(self, at):
        """Return whether a digit moves or looks otherwise than it did when it was well."""
        is_, was = self.bench.assembly.unit.hand, self.bench.assembly.healthy.hand
        for field, noticed in NOTICED.items():
            places = [at] if len(getattr(was, field)) == len(Channel) else JOINTS[at]
            if any(noticed(getattr(is_, field)[place], getattr(was, field)[place]) for place in places):
                return True
        # A cable is seen on the spool where it is wound, and which way round.
        wound = [fault for fault in self.bench.present if fault.fault.layer is FaultLayer.WINDING]
        return any(at in _about(fault) for fault in wound)

    def _measures_off(self):
        """Measure with the hand open, then while it closes."""
        off = self._is_off()
        for level in (CLOSED, 0):
            with suppress(AeroError, OSError):
                self.target.hand.command_codes([level] * len(Channel))
            for _ in range(CLOSING_S * 20):
                self.target.clock.sleep_until(self.target.clock.now() + 0.05)
                off |= self._is_off()
        return off

    def _is_off(self):
        """Compare what a meter shows with what the healthy supply would give under the same load."""
        assembly = self.bench.assembly
        is_, was = assembly.unit.hand, assembly.healthy.hand
        lost = 1.0 - assembly.mechanics.compiled.supply / is_.supply_ratio
        usual = was.supply_ratio * (1.0 - (lost * was.supply_sag / is_.supply_sag if is_.supply_sag else 0.0))
        return abs(self.bench.volts() / (assembly.healthy.servos.voltage * usual) - 1.0) > 0.05

    def _reads_another_version(self):
        assembly, named = self.bench.assembly, (self.target.firmware, self.target.side)
        return (assembly.firmware, assembly.board_side) != named

    def _reads_other_registers(self):
        """Return whether an ID is there twice, or one servo is set otherwise than most."""
        memories = [servo_of(self.bench.hand, channel).memory for channel in Channel]
        if len({memory.get("id") for memory in memories}) < len(memories):
            return True
        rows = [name for name, row in REGISTERS.items() if row.address < FEEDBACK and name not in ("id", *MOVES)]
        return any(_odd([memory.get(name) for memory in memories]) for name in rows)


MOVES = ("goal_position", "goal_speed", "goal_torque", "acceleration")
"""Registers that the board writes as it moves the hand."""
FEEDBACK = REGISTERS["present_position"].address
"""Registers from here on are measurements."""


def _odd(values):
    most = max(map(values.count, values))
    return most >= 5 and any(values.count(value) == 1 for value in values)


def open_again(hand):
    """Leave a driver as one that has just opened its port, as an owner's command does after each step."""
    with suppress(AeroError, OSError):
        hand.resynchronise()
    hand._link._text.clear()


def play(faults: Sequence[Injection], unit: str, seed: int, firmware: str, hand: Side) -> Played:
    """Play one case: validate, then step by step until it ends."""
    start = perf_counter()
    case, found, outcomes = None, False, list[str]()
    broken = busy = False
    try:
        with open_target(unit=unit, seed=seed, firmware=firmware, hand=hand, homed=True, faults=faults) as target:
            run = validate(target)
            found = not run.passed
            busy = run.end.kind is EndKind.HOST_BUSY
            case = run.diagnosis.case
            owner = Owner(target)
            while case is not None and (proposal := case.next_step) is not None:
                outcome = owner.does(proposal)
                if outcome is None:
                    open_again(target.hand)
                    outcome, after = rerun(target, case, proposal, freed=owner.freed)
                    owner.puts_back()
                    if outcome is None:
                        break
                    broken |= proposal.step.name == "again" and after.passed
                case = case.after(proposal, outcome)
    except (FaultNeverFiredError, AeroError, OSError) as error:
        outcomes.append(type(error).__name__)
    return Played(tuple(faults), found, case, tuple(outcomes), broken, perf_counter() - start, busy)
