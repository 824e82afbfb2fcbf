"""Interactive session of a case: ask, announce, rerun, store; on a terminal, on a page, and in tests."""

import re
import shlex
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import replace
from functools import partial
from pathlib import Path

from aero.channels import Channel
from aero.errors import AeroError
from aero.firmware import LONGEST_BOOT_S
from aero.printable import capital
from aero.safety import SafetyReason, SafetyStopError
from aero.safety.interrupts import let_through_at_entry, stops_held, stops_let_through
from aero.whole_file import write_whole
from hil.checks.shared.subjects import subject_words
from hil.dialogue.asker import (
    YES_OR_NO,
    Answer,
    CaseShown,
    Choice,
    FreeText,
    Motion,
    Option,
    Question,
    StepShown,
)
from hil.dialogue.before_moving import motion
from hil.dialogue.case_hand import CaseAsker, CaseHand, CaseHelper
from hil.recordings.errors import UnusableFileError
from hil.report.page import render_case
from hil.report.results import write_results
from hil.report.run_folder import CASE_PAGE, clear_run
from hil.targets.boot_text import identify
from hil.targets.hand_errors import NoHandError
from hil.targets.hands_file import called
from hil.targets.port_identity import PortIdentity
from hil.targets.target import Target
from hil.verdict.case import DiagnosisCase
from hil.verdict.case_file import CASE, STEP, StoredCase, read_case, write_case
from hil.verdict.case_words import conclusion, outcome_text, why
from hil.verdict.diagnosis import NextStep
from hil.verdict.failures import Piece
from hil.verdict.group import Proposal
from hil.verdict.judged_run import Validation
from hil.verdict.noticed import Noticed, Place
from hil.verdict.parts import listed
from hil.verdict.rerun import Outcomes, Plan, nudge, recurring, rerun
from hil.verdict.run_end import EndKind
from hil.verdict.steps import StepCheck, StepOutcome

GO_ON = "Continue the case of this run."
NOTE = FreeText("Measured, read or seen (may stay empty):")
FREED = "Was there anything to take away?"
READY = "Ready: the step is done, and the hand has power."
DONE = Option("done", StepOutcome.STAYS)
NOT_DONE = Option("cannot be done", StepOutcome.SKIPPED, "s")
OUTCOMES = (
    Option("yes", StepOutcome.YES, "y"),
    Option("no", StepOutcome.NO, "n"),
    Option("not sure", StepOutcome.UNSURE, "u"),
    NOT_DONE,
)
MARKED = "Which digit has the marked servo now?"
MOVED = "The program has moved the {where} three times. Which digit moved?"
NOT_EXCHANGED = "The marked servo is not where the step puts it, or not known to be: the exchange shows nothing."
NOTHING_MOVED = "No digit moves, so that nothing shows whether the IDs were exchanged."
KEPT_IDS = "Another digit moves than was commanded, or none is known to: the servos kept their IDs."
DIGITS: tuple[Option[Channel | str | None], ...] = (
    *(Option[Channel | str | None](subject_words(one.label), one, str(at)) for at, one in enumerate(Channel, start=1)),
    Option("none", None, "0"),
    Option("not sure", "not sure", "u"),
)
CONNECTED = "No hand answers. Are the supply and all plugs connected as before?"
ALL_CONNECTED = (Option("all is connected", True, "a"), Option("something was off", False, "o"))
REPEAT = "The run is inconclusive. {reason}. Ready to repeat it."
TOO_FEW = "It did not measure the failed readings again"
REPEATED = Option("repeat", StepOutcome.STAYS)
RUNS = 3
"""Limit of runs after one step; a step without a conclusive run counts as not sure."""
COOLS_S = 300.0
"""Time for servos to cool down after a stop for their temperature, s; an assumption, and a further stop waits again."""
TRY_S = 1.0
"""Period of connection attempts to a board that may be homing, s."""


class CaseSession:
    """Case together with its hand and its user."""

    def __init__(self, stored: StoredCase, folder: Path, hand: CaseHand, asker: CaseAsker) -> None:
        """Resume a case.

        Args:
            stored: content of the case file.
            folder: folder of the case.
            hand: hand of the case, reopened after each step.
            asker: dialogue with the user.
        """
        self.stored, self._folder, self._hand, self._asker = stored, folder, hand, asker
        self._recurring: frozenset[Piece] | None = None
        self._inconclusive = TOO_FEW

    @property
    def case(self) -> DiagnosisCase:
        """Case after all completed steps."""
        return self.stored.case

    def go_through(self) -> None:
        """Do step after step until the case is closed.

        Raises:
            KeyboardInterrupt: the person stops; every answer until then is stored.
            NoHandError: no hand answers in the time that a board may home.
        """
        self._store(self.stored)
        while (proposal := self.case.next_step) is not None:
            self._asker.show(self._shown(proposal))
            with stops_held():  # an act that was done is stored, not asked for again
                outcomes, note = self._taken(proposal, self._folder / STEP.format(len(self.case.done) + 1))
                case = self.case.after(proposal, outcomes, note)
                if self._recurring is not None:
                    case = case.narrowed(self._recurring)
                self._store(replace(self.stored, case=case, answers={}))
        said = conclusion(self.case)
        if self._again:
            said += f" Then validate again: {self._again}"
        self._asker.show(CaseShown(self._done, conclusion=said, page=str(self._folder / CASE_PAGE)))

    @property
    def _again(self) -> str:
        """Shell command that validates the hand once more, with placeholders for what was named wrongly.

        Empty for an emulated hand, which ends with the case.
        """
        if self._hand.spec.in_software:
            return ""
        spec, wrong = self._hand.spec, not self.case.gone and any(mode.of_hand for mode in self.case.shown)
        named = ["--firmware", "VERSION", "--side", "SIDE"] if wrong else ["--firmware", spec.firmware]
        side = ["--side", spec.side] if spec.side == "left" and not wrong else []
        return shlex.join(["aero-hil", "validate", "--hil", called(spec.port, spec.hand_id), *named, *side])

    @property
    def _command(self) -> str:
        """Shell command that continues the case."""
        spec = self._hand.spec
        port = [] if spec.in_software else ["--hil", called(spec.port, spec.hand_id)]
        files = [word for pair in self.stored.hand.options.items() for word in pair]
        return shlex.join(["aero-hil", "diagnose", str(self._folder), *port, *files])

    @property
    def _done(self) -> tuple[str, ...]:
        return tuple(map(outcome_text, self.case.done))

    def _shown(self, proposal: Proposal) -> CaseShown:
        touched = tuple(one for one in (proposal.at, proposal.beside) if one is not None)
        step = proposal.step
        return CaseShown(
            self._done, StepShown(proposal.text, why(self.case, proposal), step.minutes, step.tool, touched)
        )

    def _store(self, stored: StoredCase) -> None:
        if read_case(self._folder) != self.stored:
            raise UnusableFileError(
                f"{self._folder / CASE} was changed by another program meanwhile, and is left as it is; "
                "`aero-hil diagnose` again continues with it"
            )
        self.stored = stored
        write_case(self._folder, stored)
        write_whole(self._folder / CASE_PAGE, render_case(stored, self._again))

    def _ask(self, question: Question[Answer]) -> Answer:
        with stops_let_through():
            return self._asker.ask(question)

    def _answer(self, question: Question[Answer]) -> Answer:
        """Return a stored answer, or ask and store the answer."""
        with suppress(KeyError, ValueError):  # unknown, or of another version's question
            line = self.stored.answers[question.text]
            answer = question.read(line)
            self._asker.tell(f"answered   {question.text} {line or '-'}")
            return answer
        answer = self._ask(question)
        answers = {**self.stored.answers, question.text: question.line(answer)}
        self._store(replace(self.stored, answers=answers))
        return answer

    def _seen(
        self, text: str, options: tuple[Option[Answer], ...], look: Callable[[CaseHelper], Noticed] | None
    ) -> Answer:
        """Ask for the user's observation, or let the helper observe with `look`."""
        helper, noticed = self._hand.helper, None
        if helper is not None and look is not None and text not in self.stored.answers:
            helped: Choice[bool] = Choice(text, (Option("look for me", True, "l"), Option("I have looked", False, "n")))
            if self._ask(helped):
                noticed = look(helper)
                self._asker.tell(f"seen       {noticed}")
        return self._answer(Choice(text, options, noticed=noticed))

    def _do(self, proposal: Proposal) -> StepOutcome:
        """Ask until the step is done; return SKIPPED, UNSURE if the helper did it, or STAYS if the person did."""
        if (helper := self._hand.helper) is None:
            return self._ask(Choice(READY, (DONE, NOT_DONE)))
        helped = Choice(READY, (Option("do it for me", StepOutcome.UNSURE, "m"), DONE, NOT_DONE))
        if (answer := self._ask(helped)) is StepOutcome.UNSURE:
            self._asker.tell(f"done       {helper.do(proposal)}")
        return answer

    def _taken(self, proposal: Proposal, folder: Path) -> tuple[Outcomes, str]:
        """Do a step and rerun the failure; return the outcome of each group, and the user's note."""
        step, freed, every = proposal.step, False, len(self.case.opened)
        self._recurring = None
        if step.asks:
            answer = self._seen(_question(proposal.text), OUTCOMES, lambda helper: helper.see(proposal))
            return (answer,) * every, self._answer(NOTE)
        if step.frees:
            freed = self._seen(FREED, YES_OR_NO, lambda helper: helper.see(proposal))
        self._asker.announce(self._motion(proposal))
        before = PortIdentity.of(self._hand.spec.port)
        skipped, unsure = (StepOutcome.SKIPPED,) * every, (StepOutcome.UNSURE,) * every
        if (answer := self._do(proposal)) is StepOutcome.SKIPPED:
            return skipped, ""
        by_hand = answer is StepOutcome.STAYS
        if by_hand and (doubt := self._unproven(proposal, before)):
            return unsure, doubt
        # only the run is repeated: a second exchange would put the servos back
        for _ in range(RUNS):
            if (outcomes := self._rerun(proposal, folder, freed=freed)) is not None:
                # also if the failure went along: with the IDs left, that of a bad digit does
                went_along = StepOutcome.MOVED in outcomes
                ask = by_hand and step.check is StepCheck.FINGER
                doubt = self._crossed(proposal, went_along=went_along) if ask else ""
                return (unsure, doubt) if doubt else (outcomes, "")
            if self._ask(Choice(REPEAT.format(reason=self._inconclusive), (REPEATED, NOT_DONE))) is StepOutcome.SKIPPED:
                break
        return unsure, "the runs after it were inconclusive"

    def _unproven(self, proposal: Proposal, before: PortIdentity) -> str:
        """Return why a step shows nothing although it was done, or an empty text."""
        check = proposal.step.check
        if check is StepCheck.FINGER:
            place = self._seen(MARKED, DIGITS, lambda helper: helper.marked(proposal))
            return "" if place is proposal.beside else NOT_EXCHANGED
        if check in (StepCheck.BOARD, StepCheck.PORT):
            now = PortIdentity.of(self._hand.spec.port)
            if check is StepCheck.BOARD and before.same_board(now):
                return "The port has the same serial number: this is the same board."
            if check is StepCheck.PORT and before.same_hub(now):
                return "The hand is at the same socket of a hub: connect it without the hub, to another socket."
        return ""

    def _crossed(self, proposal: Proposal, *, went_along: bool) -> str:
        """Nudge the exchanged channels until one moves; return why the step shows nothing, or an empty text."""
        stopped_at = set[Channel | None]()
        for channel in (proposal.at, proposal.beside):
            assert channel is not None, "an exchange has two places"
            where = subject_words(channel.label)
            try:
                with let_through_at_entry(self._opened()) as opened, stops_let_through():
                    nudge(opened, channel)
            except (AeroError, OSError, SafetyStopError, NoHandError) as error:
                self._asker.tell(str(error))
                stopped_at |= {error.channel} if isinstance(error, SafetyStopError) else set()
                continue
            moved = self._seen(MOVED.format(where=where), DIGITS, partial(_moved_by, channel))
            if moved is channel:
                return ""
            if moved is not None:
                return KEPT_IDS
        # With a dead servo in it the hand counts as closed there, and the guard moves nothing.
        return "" if went_along and proposal.beside in stopped_at else NOTHING_MOVED

    def _rerun(self, proposal: Proposal, folder: Path, *, freed: bool) -> Outcomes | None:
        """Rerun the failure after a step; return the outcome of each group, None if inconclusive."""
        outcomes: Outcomes | None = (StepOutcome.STAYS,) * len(self.case.opened)
        run: Validation | None = None
        stop: SafetyReason | None = None
        try:
            with let_through_at_entry(self._opened()) as opened:
                folder.mkdir(exist_ok=True)
                clear_run(folder)
                outcomes, run = rerun(
                    opened, self.case, proposal, freed=freed, folder=folder, baseline=self._hand.spec.baseline,
                    progress=self._asker.progress,
                )  # fmt: skip
        except SafetyStopError as error:  # after the run, found only when the hand is closed; the readings stay valid
            self._asker.tell(str(error))
            stop, self._inconclusive = error.reason, capital(str(error)).rstrip(".")
        except NoHandError as error:
            self._asker.tell(str(error))
            if not self._ask(Choice(CONNECTED, ALL_CONNECTED)):
                raise
        if run is not None:
            stop = run.end.stop
            self._recurring = recurring(self.case, run)
            self._inconclusive = _reason(run)
            if proposal.step.check is StepCheck.VERSION and (text := _other_version(run)):
                self._asker.tell(text)
                outcomes = outcomes and (StepOutcome.UNSURE,) * len(outcomes)
            # the run belongs to this case and opens no other
            alone = replace(run.diagnosis, case=None, step=NextStep(GO_ON, self._command))
            write_results(replace(run, diagnosis=alone), folder)
            if run.end.kind is EndKind.INTERRUPTED and run.end.error is not None:
                raise run.end.error
        return outcomes if stop is None else self._stopped(stop, outcomes)

    def _stopped(self, reason: SafetyReason, outcomes: Outcomes | None) -> Outcomes | None:
        """Return the outcomes of a run that the guard stopped; wait and return None if the case itself made it hot."""
        hot = reason is SafetyReason.TEMPERATURE and not self.case.before.stopped_by(reason)
        if not hot or outcomes is None or StepOutcome.STAYS not in outcomes:
            return outcomes
        until = self._hand.clock.now() + COOLS_S
        while (left_s := until - self._hand.clock.now()) > 0.0:
            self._asker.progress(1.0 - left_s / COOLS_S, "the servos cool down", left_s)
            with stops_let_through():
                self._hand.clock.sleep_until(min(self._hand.clock.now() + TRY_S, until))
        return None

    def _motion(self, proposal: Proposal) -> Motion:
        """Return the announcement of the motion after a step, with its largest duration."""
        spec, plan = self._hand.spec, Plan.after(self.case, proposal.step, self._hand.spec.firmware)
        moves = motion(plan.furthest, plan.seconds, spec.guard, emulated=spec.in_software)
        homes = f"The hand homes (about {plan.homes_s:.0f} s). " if plan.homings else ""
        more = "".join(f"; if all passes, {', '.join(names)}" for names in plan.confirming)
        part = "; if part of the failure stays, both once more" if plan.homings else ""
        runs = f"Runs {', '.join(plan.first)} (about {plan.first_s:.0f} s with opening){more}{part}. "
        return replace(
            moves, text=f"{homes}{runs}{moves.text}", channels=tuple(Channel) if plan.homings else moves.channels
        )

    @contextmanager
    def _opened(self) -> Iterator[Target]:
        """Open the hand once its board answers; the board may home for a while after power-on."""
        begun, booted, resynchronised = self._hand.clock.now(), False, False
        with ExitStack() as stack:
            while True:
                waited_s = self._hand.clock.now() - begun
                try:
                    opened = stack.enter_context(self._hand.open())
                    if not booted:
                        break
                    # a link that has asked a booting board in vain holds back its first readings: a new one
                    stack.pop_all().close()
                    booted = False
                except NoHandError:
                    if waited_s > LONGEST_BOOT_S:
                        if resynchronised:
                            raise
                        # not before, because a homing board would keep these bytes
                        self._resynchronise()
                        resynchronised = True
                    booted = True
                self._asker.progress(0.0, "waiting for the board, which may home", max(0.0, LONGEST_BOOT_S - waited_s))
                self._hand.clock.sleep_until(self._hand.clock.now() + TRY_S)
            self._asker.follow(opened)
            yield opened

    def _resynchronise(self) -> None:
        """Complete a frame that another program has cut short, for whose rest the board waits."""
        with suppress(AeroError, OSError, SafetyStopError, NoHandError), self._hand.open(may_be_silent=True) as opened:
            if opened.hand.resynchronise():
                self._asker.tell("the board waited for the rest of a command that another program had cut short")


def _reason(run: Validation) -> str:
    """Return why a run is inconclusive: its end, or this computer's longest delay."""
    delays = [one.reason for one in sorted(run.withheld, key=lambda one: one.held_up_s)]
    return capital(run.end.reason.rstrip(".") or next(reversed(delays), TOO_FEW))


def _other_version(run: Validation) -> str:
    """Return a sentence if the boot text is of another version than the named one; empty without a text."""
    header = run.header
    boot = identify(str(header.parameters.get("boot_text", ""))) if header else None
    if header is None or boot is None or not boot.versions or header.firmware in boot.versions:
        return ""
    return f"The boot text is of firmware {listed(boot.versions)}, not {header.firmware}, which was not flashed."


def _moved_by(channel: Channel, helper: CaseHelper) -> Place:
    return helper.moved(channel)


def _question(text: str) -> str:
    """Return the question within a step's text."""
    found = re.search(r"[^.?]*\?", text)
    return text if found is None else found[0].strip()
