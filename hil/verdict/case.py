"""A case: what a failed run leaves suspected, the steps that were done since, and what they convict."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

from aero.channels import Channel
from hil.checks import ALIKE, DEFAULT, DRIVER, EXPERIMENTS, WHOLE_RUN
from hil.verdict.failures import FAR, RUN, Failures
from hil.verdict.parts import Part, Suspect
from hil.verdict.steps import BY_CHANCE, OF_ONE, CaseStep, StepOutcome, Way, neighbour, steps, ways

SURE = 0.75
"""Likelihood from which on a suspect that a step convicts is told."""
SURE_OF_THE_REST = 0.86
"""The same of one that is convicted because a failure stays."""
REMAINS = 0.1
"""Likelihood from which on a suspect is named among those that remain."""
SURE_TOGETHER = 0.88
"""The same of suspects of one part that steps convict together."""
HANDLING, FETCHING = 5.0, 6.0
"""What any step costs besides its minutes, and one with a tool again, min: few steps, and without a tool first."""
WORTH_A_STEP = 0.01
"""Bits a minute from which on a step is worth its time."""
GONE_BELOW, MOVED_FROM = 0.3, 0.4
"""Parts of what failed before that are left where a failure is gone, and found at the neighbour where it went along."""
LEFT_AT_MOST = 2.0 * FAR
"""Weight of all that fails after a step from which on nothing is gone, however much more failed before."""
WARMS = (ALIKE.name, "temperature")
"""Check that work changes by itself, a little."""
MOST_STEPS = 4
MAY_PASS = 0.2
"""How likely so little passes in another run although nothing was mended."""
MOST_OF_IT = 0.75
"""Part of what failed that is run again after a step; what happened once is in less of it."""


@dataclass(frozen=True)
class Proposal:
    """A step at a place."""

    step: CaseStep
    at: Channel | None = None
    beside: Channel | None = None

    @property
    def text(self) -> str:
        """What the person does."""
        return self.step.text(self.at, self.beside)


@dataclass(frozen=True)
class Done:
    """A step that was done."""

    proposal: Proposal
    outcome: StepOutcome
    note: str = ""
    """What a person measured or saw."""

    @property
    def ends(self) -> bool:
        """Whether the failure is gone and stays so."""
        return self.outcome in (StepOutcome.GONE, StepOutcome.FREED) and not self.proposal.step.restores


@dataclass(frozen=True)
class DiagnosisCase:
    """Suspects of a failed run and the steps since; pure."""

    before: Failures
    """What failed."""
    suspects: Mapping[Suspect, float]
    """How likely each is by the run alone; they sum to 1."""
    experiments: tuple[str, ...] = ()
    """What shows the failure, in the order in which it is run."""
    ran: tuple[str, ...] = ()
    """All that was run before."""
    done: tuple[Done, ...] = ()

    @property
    def likely(self) -> dict[Suspect, float]:
        """How likely each suspect is after all steps, the likeliest first."""
        return _of_suspects(self._by_way)

    @property
    def _by_way(self) -> dict[tuple[Suspect, Way], float]:
        """How likely each way of each suspect is; what a step has excluded of one says what is left of it."""
        weights = {
            (s, way): weight * share for s, weight in self.suspects.items() for way, share in ways()[s.part].items()
        }
        for number, one in enumerate(self.done):
            weights = self._given(weights, one.proposal, one.outcome, self.done[:number])
        scale = sum(weights.values()) or 1.0
        return {key: weight / scale for key, weight in weights.items()}

    def failed_in(self, experiments: Iterable[str]) -> Failures:
        """Return what failed in some experiments and in the run as a whole."""
        again = {*experiments, ALIKE.name, WHOLE_RUN.name, DRIVER.name, RUN}
        return Failures({key: excess for key, excess in self.before.off.items() if key[0] in again})

    @property
    def convicted(self) -> Suspect | None:
        """The suspect that a step has convicted, None where none is."""
        return self._proven(self.likely, self.done)

    @property
    def remaining(self) -> tuple[Suspect, ...]:
        """What remains suspected."""
        return tuple(suspect for suspect, weight in self.likely.items() if weight >= REMAINS)

    @property
    def next_step(self) -> Proposal | None:
        """The step that says most for its minutes; None where the case is closed or no step says enough."""
        # A failure that is gone cannot be seen to go again.
        if self.convicted is not None or self.gone or len(self.done) >= MOST_STEPS or not self.suspects:
            return None
        # What needs no tool comes first, whatever is likeliest.
        proposals = [one for one in self._proposals() if self.done or not one.step.tool]
        best = max(proposals, key=self._worth, default=None)
        if best is None or self._worth(best) < WORTH_A_STEP:
            return None
        return Proposal(steps()["again"]) if self._once_by_chance and not self.done else best

    @property
    def gone(self) -> bool:
        """Whether the failure is gone after the last step."""
        return bool(self.done) and self.done[-1].ends

    @property
    def _once_by_chance(self) -> bool:
        """Whether what failed may have happened once: it must fail again before a step can mend it."""
        once = any(experiment in (WHOLE_RUN.name, RUN) for experiment, _, _ in self.before.off)
        return once or self.before.weight(self.before.off) < FAR

    def after(self, proposal: Proposal, outcome: StepOutcome, note: str = "") -> DiagnosisCase:
        """Return the case with one more step done."""
        return replace(self, done=(*self.done, Done(proposal, outcome, note)))

    def _proposals(self) -> list[Proposal]:
        tried = {(one.proposal.step.name, one.proposal.at) for one in self.done}
        failing = frozenset(s.channel for s in self.suspects if s.channel is not None)
        homed = any(one.proposal.step.homes for one in self.done)
        waits = not homed and next(iter(self.likely)).part in (Part.SETUP, Part.SERVO)
        found = []
        for step in steps().values():
            if waits and step.after_homing:
                continue
            places: list[Channel | None] = [None]
            if step.of_one_channel:
                places = [s.channel for s in self.likely if s.part in OF_ONE and s.channel is not None]
            for at in dict.fromkeys(places):
                if (step.name, at) not in tried:
                    found.append(Proposal(step, at, None if at is None else neighbour(at, failing)))
        return found

    def _proven(self, likely: Mapping[Suspect, float], done: Sequence[Done]) -> Suspect | None:
        """Return the likeliest suspect that an outcome proves, None where those proven are not likely enough together.

        Two digits may be at fault together, as where their cables are exchanged.
        """
        found = {
            suspect: one.outcome
            for one in done
            for suspect in one.proposal.step.convicted(one.outcome, one.proposal.at)
        }
        proven = [s for s in likely if any(f.part is s.part and f.channel in (None, s.channel) for f in found)]
        if not proven:
            return None
        together = sum(likely[s] for s in proven if s.part is proven[0].part) >= SURE_TOGETHER
        if found.get(proven[0]) is not StepOutcome.STAYS:
            return proven[0] if together or likely[proven[0]] >= SURE else None
        # What stays may be a third part's, which nobody thought of; a little may be a healthy hand's.
        clear = self.before.weight(self.before.off) >= FAR
        return proven[0] if clear and (together or likely[proven[0]] >= SURE_OF_THE_REST) else None

    def _given(
        self,
        weights: Mapping[tuple[Suspect, Way], float],
        proposal: Proposal,
        outcome: StepOutcome,
        done: Sequence[Done],
    ) -> dict[tuple[Suspect, Way], float]:
        """Return the weights after one more step, of what was done before it."""
        # A little that came again is no chance, but for another servo in its place, which reads a little otherwise.
        again = (
            any(one.outcome is StepOutcome.STAYS for one in done) and StepOutcome.MOVED not in proposal.step.outcomes
        )
        chance = BY_CHANCE if again or self.before.weight(self.before.off) >= FAR else MAY_PASS
        return {
            (suspect, way): weight * proposal.step.likelihood(outcome, way, suspect.channel, proposal.at, chance)
            for (suspect, way), weight in weights.items()
        }

    def _worth(self, proposal: Proposal) -> float:
        """Return the bits that a step is expected to say, and how likely it convicts, for each minute."""
        likely, step = self._by_way, proposal.step
        gained = convicts = 0.0
        for outcome in step.outcomes:
            joint = self._given(likely, proposal, outcome, self.done)
            chance = sum(joint.values())
            after = _of_suspects(joint)
            gained += chance * (_bits(self.likely) - _bits(after))
            convicts += chance * (self._proven(after, (*self.done, Done(proposal, outcome))) is not None)
        return (gained + convicts) / (step.minutes + HANDLING + (FETCHING if step.tool else 0.0))


def that_show(failures: Failures, ran: Sequence[str]) -> tuple[str, ...]:
    """Return the experiments that show failures: the fewest of those that ran; all where a run ended."""
    failed = {experiment for experiment, _, _ in failures.off}
    if RUN in failed:
        # A run ends where it ends by chance: what ran until then might pass on the same hand.
        return tuple(name for name in EXPERIMENTS if name in {*ran, *DEFAULT})
    if failed & {WHOLE_RUN.name, DRIVER.name}:
        # Bytes are lost by chance: less of it might pass on the same hand.
        return tuple(ran)
    weights: dict[str, float] = {}
    for key in failures.off:
        weights[key[0]] = weights.get(key[0], 0.0) + failures.weight([key])
    chosen, left = set[str](), MOST_OF_IT * sum(weights.values())
    for name in sorted(weights, key=lambda one: (-weights[one], one)):
        if left > 0:
            chosen |= set(ran) if name == ALIKE.name else {name}
        left -= weights[name]
    return tuple(name for name in ran if name in chosen)


def outcome_of(before: Failures, after: Failures, proposal: Proposal) -> StepOutcome | None:
    """Return what became of a failure, from what the same experiments found before and after a step.

    None where too little of what failed was measured again to say that it is gone.
    """
    step, at, beside = proposal.step, proposal.at, proposal.beside
    # A hand that has worked for minutes is warmer: of many runs, each would fail.
    warm = {key for key, by in after.off.items() if key[:2] == WARMS and abs(by) < FAR and key not in before.off}
    after = replace(after, off={key: by for key, by in after.off.items() if key not in warm})
    measured = before.weight(key for key in before.off if key in after.known or key[0] == RUN)
    gone: StepOutcome | None = StepOutcome.GONE
    if measured < MOST_OF_IT * before.weight(before.off):
        # A run that ended at its first gate measures little of what failed, and may fail worse.
        gone = StepOutcome.STAYS if after.off else None
    if at is None or beside is None:
        # Bytes that are lost by chance are lost less often in one run than in another.
        again = any(key[0] in (WHOLE_RUN.name, RUN) for key in before.off.keys() & after.off.keys())
        subjects = {subject for _, _, subject in before.off} - {"hand"}
        same = [key for key in after.off if key in before.off or key[2] in subjects or key[0] == RUN]
        # One that has homed has other zeros: a little elsewhere is not the failure.
        little = after.weight(same) < GONE_BELOW * before.weight(before.off) and after.weight(after.off) < LEFT_AT_MOST
        return gone if little and not again else StepOutcome.STAYS

    def on(failures: Failures, channel: Channel) -> float:
        return failures.weight(failures.keys(lambda _, subject: subject == channel.label))

    here, was, along = on(after, at), on(before, at), on(after, beside) - on(before, beside)
    # It must have left where it was: noise on the bus that wanders over the channels convicts no servo. What reads to
    # the other side now has left, too: a servo is cold beside one that is hot.
    turned = {key for key, by in after.off.items() if by * before.off.get(key, by) < 0.0}
    stays = after.weight(after.keys(lambda _, subject: subject == at.label) - turned)
    if StepOutcome.MOVED in step.outcomes and along >= MOVED_FROM * was > stays:
        return StepOutcome.MOVED
    return gone if here < min(GONE_BELOW * was, LEFT_AT_MOST) and along < LEFT_AT_MOST else StepOutcome.STAYS


def _of_suspects(weights: Mapping[tuple[Suspect, Way], float]) -> dict[Suspect, float]:
    """Return how likely each suspect is in any of its ways, the likeliest first; they sum to 1."""
    total = sum(weights.values()) or 1.0
    found: dict[Suspect, float] = {}
    for (suspect, _), weight in weights.items():
        found[suspect] = found.get(suspect, 0.0) + weight / total
    return dict(sorted(found.items(), key=lambda one: -one[1]))


def _bits(likely: Mapping[Suspect, float]) -> float:
    return -sum(weight * math.log2(weight) for weight in likely.values() if weight > 0)
