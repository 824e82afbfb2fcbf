"""Simulated owner: validates an emulated hand and completes its case with only the information on display.

The hand is guarded and reopened for each step, on virtual time. The answers follow from the displayed observations; the
injected fault is never queried.
"""

from collections.abc import Sequence
from contextlib import closing, suppress
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time

from aero.channels import FINGERS
from aero.errors import AeroError
from aero.safety import SafetyStopError
from aero.side import Side
from hil.dialogue.asker import Choice
from hil.dialogue.case_session import MARKED, READY, CaseSession
from hil.emulated.emulated_case import EmulatedCaseHand
from hil.emulated.emulated_spec import EmulatedSpec
from hil.emulated.faults.fault import FaultLayer, Injection
from hil.emulated.faults.winding import NEIGHBOUR
from hil.report.results import write_case_of, write_results
from hil.targets.hand_errors import NoHandError
from hil.verdict.case import DiagnosisCase
from hil.verdict.case_file import CASE, read_case
from hil.verdict.noticed import Differences, Flashed, Place, Removed, Voltages
from hil.verdict.part import Part
from hil.verdict.parts import Suspect
from hil.verdict.run_end import EndKind
from hil.verdict.steps import StepOutcome
from hil.verdict.validation import validate

OFF = 0.05
"""Relative error of a voltage that an owner notices on a meter."""
REST_S = 120.0
"""Time between homing and the first run, in which servos cool down, s."""


class Slip(Enum):
    """Mistake of an owner."""

    FORGETS_IDS = "exchanges the servos, and leaves their IDs"
    WRONG_PAIR = "exchanges the neighbour with a third servo"
    DOES_NOTHING = "says that the servos are exchanged, and leaves them"
    WRONG_ANSWER = "answers the first question about the hand wrongly"


class Owner:
    """Lets the helper do each step, and answers from its observations; or makes one mistake."""

    def __init__(self, hand=None, slip=None):
        self.shown, self._hand, self._slip = [], hand, slip
        self._step, self._wrong_once = None, slip is Slip.WRONG_ANSWER

    def ask(self, question):
        if not isinstance(question, Choice):
            return ""
        answers = {option.label: option.answer for option in question.options}
        if question.noticed is None:
            return self._done(question) or question.options[0].answer
        if isinstance(question.noticed, Place):
            return self._seen_after_slip(question)
        yes = differs(question.noticed)
        if self._wrong_once:
            yes, self._wrong_once = not yes, False
        return answers["yes" if yes else "no"]

    def _done(self, question):
        """Do an exchange wrongly; return the answer that it is done, or None for what the helper does."""
        exchanges = self._step is not None and "Exchange" in self._step.do
        if not exchanges or question.text != READY or self._slip in {None, Slip.WRONG_ANSWER}:
            return None
        if self._slip is Slip.WRONG_PAIR:
            self._hand.workbench.exchange_servos(self._beside, self._third)
        return StepOutcome.STAYS

    @property
    def _beside(self):
        return self._step.channels[1]

    @property
    def _third(self):
        return next(one for one in FINGERS if one not in self._step.channels)

    def _seen_after_slip(self, question):
        """Answer where the marked servo is, or which digit moved, as the mistake leaves it."""
        marked = question.text == MARKED
        match self._slip:
            case Slip.FORGETS_IDS:
                # the other servo of the pair has the nudged channel's ID
                other = {self._step.channels[0]: self._beside, self._beside: self._step.channels[0]}
                return self._beside if marked else other[question.noticed.channel]
            case Slip.WRONG_PAIR:
                return self._third if marked else question.noticed.channel
            case Slip.DOES_NOTHING:
                return None if marked else question.noticed.channel
        return question.noticed.channel

    def show(self, case):
        self.shown.append(case)
        self._step = case.step

    def announce(self, motion):
        self.shown.append(motion)

    def follow(self, target):
        """Look on."""

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


def play(
    faults: Sequence[Injection], unit: str, seed: int, firmware: str, side: Side, *, slip: Slip | None = None
) -> Played:
    """Complete one case: validate, then do steps until the case ends; the owner makes a mistake, or none."""
    start = process_time()
    spec = EmulatedSpec(
        firmware=firmware, side=side, unit=unit, seed=seed, guarded=True, homed=True, faults=tuple(faults)
    )
    with TemporaryDirectory() as name, closing(EmulatedCaseHand(spec)) as hand:
        folder = Path(name)
        owner = Owner(hand, slip)
        found, busy, ended, session = True, False, "", None
        try:
            # It homes, as the README says, and rests; an owner whose hand does not home validates all the same.
            with suppress(NoHandError, AeroError, OSError, SafetyStopError), hand.open():
                pass
            hand.clock.sleep_until(hand.clock.now() + REST_S)
            run = None
            try:
                with hand.open(may_be_silent=True) as target:
                    run = validate(target)
            except SafetyStopError:  # found when the hand is closed; the readings stay valid
                if run is None:
                    raise
            found, busy = not run.passed, run.end.kind is EndKind.HOST_BUSY
            write_results(run, folder)
            write_case_of(run, folder)
            if (folder / CASE).exists():
                session = CaseSession(read_case(folder), folder, hand, owner)
                session.go_through()
        except (NoHandError, AeroError, OSError, SafetyStopError) as error:
            ended = f"{type(error).__name__}: {error}"
        broken = any(one.startswith("inject") for one in hand.workbench.acts_present)
    case = None if session is None else session.case
    return Played(found, case, busy, ended, process_time() - start, broken, tuple(owner.shown))
