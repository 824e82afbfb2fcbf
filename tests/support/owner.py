"""Simulated owner: validates an emulated hand and completes its case with only the information on display.

The hand is guarded and reopened for each step, on virtual time. The answers follow from the displayed observations; the
injected fault is never queried.
"""

from collections.abc import Sequence
from contextlib import closing, suppress
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time

from aero.errors import AeroError
from aero.safety import SafetyStopError
from aero.side import Side
from hil.dialogue.asker import Choice
from hil.dialogue.case_session import CaseSession
from hil.emulated.emulated_case import EmulatedCaseHand
from hil.emulated.emulated_spec import EmulatedSpec
from hil.emulated.faults.fault import FaultLayer, Injection
from hil.emulated.faults.winding import NEIGHBOUR
from hil.emulated.standing_hand import StandingHand
from hil.report.results import write_results
from hil.targets.hand_errors import NoHandError
from hil.verdict.case import DiagnosisCase
from hil.verdict.case_file import CASE, read_case
from hil.verdict.noticed import Differences, Flashed, Place, Removed, Voltages
from hil.verdict.part import Part
from hil.verdict.parts import Suspect
from hil.verdict.run_end import EndKind
from hil.verdict.validation import validate

OFF = 0.05
"""Relative error of a voltage that an owner notices on a meter."""
REST_S = 120.0
"""Time between homing and the first run, in which servos cool down, s."""


class Owner:
    """Lets the helper do each step, and answers from its observations."""

    def __init__(self):
        self.shown = []

    def ask(self, question):
        if not isinstance(question, Choice):
            return ""
        if question.noticed is None:
            return question.options[0].answer
        if isinstance(question.noticed, Place):
            return question.noticed.channel
        answers = {option.label: option.answer for option in question.options}
        return answers["yes" if differs(question.noticed) else "no"]

    def show(self, case):
        self.shown.append(case)

    def announce(self, motion):
        self.shown.append(motion)

    def progress(self, part, doing, left_s):
        """Wait."""

    def tell(self, text):
        self.shown.append(text)


def differs(noticed):
    """Return whether an observation means yes: a difference, a removed object, or a wrong voltage."""
    match noticed:
        case Voltages(at_rest, closing, usual):
            return any(abs(volts / usual - 1.0) > OFF for volts in (at_rest, closing))
        case Flashed(version, side, named_version, named_side):
            return (version, side) != (named_version, named_side)
        case Differences(_, of):
            # the neighbour is bent for comparison
            return bool(next(iter(of.values())))
        case Removed(found):
            return found
    raise AssertionError(f"{noticed} answers no question with yes or no")


@dataclass(frozen=True)
class Played:
    """Completed case."""

    found: bool
    """Whether the validation failed."""
    case: DiagnosisCase | None
    busy: bool = False
    """Whether the validation reported a busy computer, whose effects a step need not show."""
    ended: str = ""
    """Error that ended the case."""
    cpu_s: float = 0.0
    broken: bool = False
    """Whether the hand has a fault at the end."""
    shown: tuple[object, ...] = ()

    @property
    def told(self) -> tuple[Suspect, ...]:
        """Convicted part, or the parts whose state was reset."""
        return (Suspect(Part.COMPUTER),) if self.busy else () if self.case is None else self.case.told

    @property
    def mended(self) -> bool:
        """Whether the case says that the failure is gone and its cause known."""
        return self.case is not None and self.case.mended

    @property
    def minutes(self) -> float:
        return sum(done.proposal.step.minutes for done in self.case.done) if self.case else 0.0


def is_right(suspect: Suspect, fault: Injection, *, alike: bool = False) -> bool:
    """Return whether a suspect is the part of a fault, or with `alike` a part whose fault looks identical."""
    parts = fault.parts if alike else (fault.part,)
    return suspect.part in parts and (suspect.channel in {None, *_about(fault)} or fault.channel is None)


def _about(fault):
    """Return the channels of a fault."""
    two = fault.channel is not None and (fault.fault.layer is FaultLayer.WINDING or fault.fault.excludes == "id")
    return {fault.channel, NEIGHBOUR.get(fault.channel)} if two else {fault.channel}


def play(faults: Sequence[Injection], unit: str, seed: int, firmware: str, side: Side) -> Played:
    """Complete one case: validate, then do steps until the case ends."""
    start = process_time()
    spec = EmulatedSpec(
        firmware=firmware, side=side, unit=unit, seed=seed, guarded=True, homed=True, faults=tuple(faults)
    )
    with TemporaryDirectory() as name, closing(StandingHand(spec)) as standing:
        folder, hand, owner = Path(name), EmulatedCaseHand(standing), Owner()
        found, busy, ended, session = True, False, "", None
        try:
            # It homes, as the README says, and rests; an owner whose hand does not home validates all the same.
            with suppress(NoHandError, AeroError, OSError, SafetyStopError), hand.open():
                pass
            hand.clock.sleep_until(hand.clock.now() + REST_S)
            run = None
            try:
                with standing.open(may_be_silent=True) as target:
                    run = validate(target)
            except SafetyStopError:  # found when the hand is closed; the readings stay valid
                if run is None:
                    raise
            found, busy = not run.passed, run.end.kind is EndKind.HOST_BUSY
            write_results(run, folder)
            if (folder / CASE).exists():
                session = CaseSession(read_case(folder), folder, hand, owner)
                session.go_through()
        except (NoHandError, AeroError, OSError, SafetyStopError) as error:
            ended = f"{type(error).__name__}: {error}"
        broken = any(one.startswith("inject") for one in standing.workbench.acts_present)
    case = None if session is None else session.case
    return Played(found, case, busy, ended, process_time() - start, broken, tuple(owner.shown))
