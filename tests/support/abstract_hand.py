"""Abstract hand: parts with faults and the evidence that each makes, without any simulation.

A case runs on it in milliseconds, so that its logic is tested on many faults. Each rerun measures every reading.
"""

from dataclasses import dataclass, replace
from random import Random

from aero.channels import FINGERS, Channel
from hil.checks import JUDGED
from hil.checks.shared.declaration import EvidenceKind as Kind
from hil.verdict.case import DiagnosisCase, groups_of
from hil.verdict.failures import EVIDENCE, Failures
from hil.verdict.outcome import failed_in, outcome_of
from hil.verdict.part import Part
from hil.verdict.parts import Suspect
from hil.verdict.run_end import FINISHED
from hil.verdict.steps import StepCheck, StepOutcome
from hil.verdict.suspects import IN_MOTION, LOADED, RunSigns, isolate

KEYS = sorted(
    (judged.name, metric.name, subject)
    for judged in JUDGED.values()
    for metric in judged.metrics
    if metric.evidence is not None
    for subject in metric.subjects
)
ON_CHANNEL = {Part.SERVO: LOADED | IN_MOTION | {Kind.OWN_SENSOR}, Part.DIGIT: LOADED | {Kind.TIME, Kind.JUMP}}
ON_HAND = {
    Part.USB: {Kind.BYTES, Kind.STALL, Kind.LINK_TIME},
    Part.COMPUTER: {Kind.BYTES, Kind.STALL, Kind.TEXT},
    Part.DRIVER: {Kind.SENT},
    Part.BOARD: {Kind.RESTART, Kind.LINK_TIME, Kind.BYTES},
    Part.SUPPLY: {Kind.SPEED, Kind.RESTART},
    Part.BUS: {Kind.STALE, Kind.LINK_TIME},
}
ENDS = {
    "mend": Part.DIGIT,
    "cable": Part.USB,
    "plugs": Part.BUS,
    "release": Part.DRIVER,
    "flash": Part.BOARD,
    "board": Part.BOARD,
    "supply": Part.SUPPLY,
}
"""Part whose faults a step ends; `mend` at its channel only."""


@dataclass(frozen=True)
class AbstractFault:
    """Fault of a part with the evidence that it makes."""

    part: Part
    channel: Channel | None
    kinds: frozenset[Kind]
    chance: bool = False
    """Whether it happens in the first run only."""
    shows: str = ""
    """Question that a person answers with yes because of it."""
    flashed: bool = False
    """Whether flashing ends a fault of the board."""

    def off(self) -> dict[tuple[str, str, str], float]:
        """Return the failed readings."""
        on = "hand" if self.channel is None else self.channel.label
        found = {}
        for kind in self.kinds:
            # an exchanged servo may be where a kind is not measured
            keys = (key for key in KEYS if EVIDENCE[key[:2]] is kind and on in (key[2], "hand"))
            found |= {key: 3.0 for key in [next(keys, None)] if key is not None}
        return found


def drawn(random: Random, part: Part | None = None) -> AbstractFault:
    """Return a fault of a part, or of any part, digits and servos most often."""
    weights = {one: 6 if one in ON_CHANNEL else 1 for one in (*ON_CHANNEL, *ON_HAND)}
    part = part or random.choices([*weights], [*weights.values()])[0]
    kinds = sorted(ON_CHANNEL.get(part) or ON_HAND[part], key=lambda kind: kind.value)
    some = frozenset(random.sample(kinds, min(len(kinds), random.randrange(1, 5))))
    if part in ON_CHANNEL:
        possible = [one for one in Channel if all(_measured(kind, one.label) for kind in some)]
        if not possible:
            return drawn(random, part)
        shows = random.choice(["", "inspect", "bend"]) if part is Part.DIGIT else ""
        return AbstractFault(part, random.choice(possible), some, shows=shows)
    return AbstractFault(
        part, None, some, shows="voltage" if part is Part.SUPPLY else "", flashed=random.random() < 0.5
    )


def _measured(kind: Kind, label: str) -> bool:
    return any(EVIDENCE[key[:2]] is kind and key[2] == label for key in KEYS)


class AbstractHand:
    """Hand with faults, on which steps are done and runs are made."""

    def __init__(self, *faults: AbstractFault) -> None:
        self.faults, self._aside = list(faults), []

    def run(self, *, first: bool = False) -> Failures:
        """Return the failures of a run of all experiments."""
        off = {key: x for one in self.faults if first or not one.chance for key, x in one.off().items()}
        return Failures(off, frozenset(KEYS), complete=True)

    def case(self) -> DiagnosisCase:
        """Return the case of the first run."""
        failures = self.run(first=True).by_fault
        ran = tuple(dict.fromkeys(key[0] for key in KEYS))
        return DiagnosisCase(groups_of(isolate(RunSigns(failures, FINISHED)), failures), ran, ran)

    def do(self, proposal) -> None:
        """Do a step."""
        self.faults += self._aside
        self._aside = []
        name, at, beside = proposal.step.name, proposal.at, proposal.beside
        if name == "computer":
            self._aside = [one for one in self.faults if one.part in (Part.COMPUTER, Part.DRIVER)]
            self.faults = [one for one in self.faults if one not in self._aside]
        if (part := ENDS.get(name)) is not None:
            stays = (lambda one: not one.flashed) if name == "flash" else lambda one: at not in (None, one.channel)
            self.faults = [one for one in self.faults if one.part is not part or stays(one)]
        if name == "exchange":
            there = {at: beside, beside: at}
            self.faults = [
                replace(one, channel=there.get(one.channel, one.channel)) if one.part is Part.SERVO else one
                for one in self.faults
            ]

    def answer(self, proposal) -> StepOutcome:
        """Return a person's answer to a question."""
        shown = any(one.shows == proposal.step.name and proposal.at in (None, one.channel) for one in self.faults)
        return StepOutcome.YES if shown else StepOutcome.NO


def played(hand: AbstractHand, *, wrong_answer: bool = False, idle: bool = False) -> DiagnosisCase:
    """Complete the case of a hand; the owner answers once wrongly, or does no exchange, which the case finds out."""
    case = hand.case()
    while (proposal := case.next_step) is not None:
        if proposal.step.asks:
            answer = hand.answer(proposal)
            if wrong_answer:
                answer = StepOutcome.NO if answer is StepOutcome.YES else StepOutcome.YES
                wrong_answer = False
            case = case.after(proposal, answer)
            continue
        if idle and proposal.step.check is StepCheck.FINGER:
            case = case.after(proposal, StepOutcome.UNSURE)
            continue
        hand.do(proposal)
        after = hand.run().by_fault
        found = [outcome_of(failed_in(one.before, case.ran), after, proposal) for one in case.groups]
        outcomes = [one or StepOutcome.UNSURE for one in found]
        left = any(one.convicted and not one.gone for one in case.groups)
        if {*outcomes} == {StepOutcome.GONE} and after.off and not left:
            outcomes = [StepOutcome.PARTLY] * len(outcomes)
        case = case.after(proposal, outcomes)
        case = case.narrowed(after.pieces)
    return case


def is_of(suspect: Suspect, fault: AbstractFault) -> bool:
    """Return whether a suspect is the part of a fault; the thumb's digits are one."""
    return suspect.part is fault.part and (fault.channel is None or _digit(suspect) == _digit(fault))


def _digit(one: Suspect | AbstractFault) -> object:
    thumb = one.part is Part.DIGIT and one.channel not in FINGERS
    return "thumb" if thumb else one.channel
