"""Failed readings of a run and their evidence: the input of every rule of the diagnosis."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from typing import NamedTuple

from aero.channels import Channel
from aero.errors import NoTelemetryError
from aero.safety import SafetyReason
from hil.checks import JUDGED, Measured
from hil.checks.shared.declaration import EvidenceKind
from hil.verdict.limits import BEYOND_GIVEN, Key, Limit, excesses, out_of_limits
from hil.verdict.run_end import FINISHED, EndKind, RunEnd

RUN = "run"
"""Substitute for an experiment's name in the failure of a run that the hand ended."""
HANDS_FAULT = {EndKind.STOPPED, EndKind.LINK, EndKind.FIRMWARE}
TO_ITS_END = {EndKind.FINISHED, EndKind.HOST_BUSY}
LABELS = {channel.label: channel for channel in Channel}
STOPS = {
    SafetyReason.CURRENT: EvidenceKind.TORQUE,
    SafetyReason.CURRENT_AT_REST: EvidenceKind.TORQUE,
    SafetyReason.TEMPERATURE: EvidenceKind.OWN_SENSOR,
    SafetyReason.STALE: EvidenceKind.STALE,
    SafetyReason.JUMP: EvidenceKind.JUMP,
    SafetyReason.STRAY: EvidenceKind.TRAVEL,
    SafetyReason.MOTION_AT_REST: EvidenceKind.TRAVEL,
    SafetyReason.STILL_CLOSED: EvidenceKind.TRAVEL,
    SafetyReason.UNWATCHED: EvidenceKind.STALL,
    SafetyReason.SILENT: EvidenceKind.BYTES,
    SafetyReason.LINK_LOST: EvidenceKind.BYTES,
}
"""Evidence of a guard stop, on the channel that the guard names; other stop reasons concern the program."""
ENDED, UNREAD = "ended", "unread"
"""Ends by an error: of the link, or of a board that has not read its servos."""
BY_CHANCE = {EvidenceKind.BYTES, EvidenceKind.TEXT, EvidenceKind.STALL, EvidenceKind.RESTART}
"""Evidence of chance events, which a second run of the same hand may miss."""
EVIDENCE: Mapping[tuple[str, str], EvidenceKind] = (
    {
        (measuring.name, metric.name): metric.evidence
        for measuring in JUDGED.values()
        for metric in measuring.metrics
        if metric.evidence is not None
    }
    | {(RUN, reason.value): kind for reason, kind in STOPS.items()}
    | {(RUN, ENDED): EvidenceKind.BYTES, (RUN, UNREAD): EvidenceKind.STALE}
)


class Piece(NamedTuple):
    """Piece of evidence: all failed readings of one kind and sign on one subject."""

    subject: str
    kind: EvidenceKind
    high: bool


@dataclass(frozen=True)
class Failures:
    """Readings out of limits, by experiment, metric and subject."""

    off: Mapping[Key, float] = field(default_factory=dict)
    """Excess of each failed reading (`Limit.excess`), above 1 or below -1."""
    known: frozenset[Key] = frozenset()
    """Readings that were measured and judged, passed ones included."""
    complete: bool = False
    """Whether the run reached its end."""
    doubtful: Mapping[Key, float] = field(default_factory=dict)
    """Excess of each reading within its limit, but beyond those of all healthy hands."""

    @classmethod
    def of(cls, numbers: Mapping[str, Measured], limits: Collection[Limit], end: RunEnd = FINISHED) -> Failures:
        """Return the failures of a run: readings out of limits (unmeasurable ones excluded) and a fault-like end."""
        found = excesses(numbers, limits)
        known = {key: excess for key, excess in found.items() if excess is not None}
        off = {key: excess for key, excess in known.items() if out_of_limits(excess)}
        doubtful = {key: excess for key, excess in known.items() if excess and key not in off}
        if end.kind in HANDS_FAULT and (end.stop is None or end.stop in STOPS):
            by_error = UNREAD if isinstance(end.error, NoTelemetryError) else ENDED
            what = by_error if end.stop is None else end.stop.value
            off[RUN, what, "hand" if end.channel is None else end.channel.label] = BEYOND_GIVEN
        return cls(off, frozenset(known), end.kind in TO_ITS_END, doubtful)

    @property
    def ended(self) -> bool:
        """Whether the hand ended the run."""
        return any(key[0] == RUN for key in self.off)

    @property
    def link_lost(self) -> bool:
        """Whether a lost link ended the run."""
        return any(key[0] == RUN and EVIDENCE[key[:2]] is EvidenceKind.BYTES for key in self.off)

    def stopped_by(self, reason: SafetyReason) -> bool:
        """Return whether the guard stopped the run for a reason."""
        return any(key[:2] == (RUN, reason.value) for key in self.off)

    @property
    def pieces(self) -> frozenset[Piece]:
        """Evidence of the failures."""
        return frozenset(map(self._piece, self.off))

    def recurring(self, after: Failures) -> frozenset[Piece]:
        """Return the evidence that recurs in a later run: a failed reading is not yet among those of healthy hands.

        A reading near its limit fails in one run and passes in the next on the same hand. Temperatures fail only beyond
        their limits, because the runs of a case warm the servos up.
        """
        lasting = (key for key, excess in self.off.items() if excess * after.doubtful.get(key, 0.0) > 0.0)
        still = {piece for piece in map(self._piece, lasting) if piece.kind is not EvidenceKind.OWN_SENSOR}
        return self.pieces & (after.pieces | still)

    @property
    def strongest(self) -> Piece | None:
        """Piece for the end of the run, else for the largest excess; None if nothing failed."""
        if not self.off:
            return None
        return self._piece(max(self.off, key=lambda key: (key[0] == RUN, abs(self.off[key]))))

    @property
    def measured(self) -> frozenset[tuple[str, EvidenceKind]]:
        """Subjects and kinds with a judged reading, or with the end of the run."""
        return frozenset((key[2], EVIDENCE[key[:2]]) for key in (*self.known, *self.off))

    def kinds(self, subject: str) -> frozenset[EvidenceKind]:
        """Return the kinds of evidence on a subject."""
        return frozenset(piece.kind for piece in self.pieces if piece.subject == subject)

    @property
    def by_fault(self) -> Failures:
        """Failures without the temperatures that follow another digit's failure.

        Beside a failing digit, other servos work more or less than usual and become warmer or colder.
        """
        worked = any(self.kinds(one.label) - {EvidenceKind.OWN_SENSOR} for one in Channel)
        idle = {one.label for one in Channel if self.kinds(one.label) == {EvidenceKind.OWN_SENSOR}}
        return replace(self, off={key: x for key, x in self.off.items() if key[2] not in idle}) if worked else self

    def of_pieces(self, pieces: Collection[Piece]) -> Failures:
        """Return the failures that belong to these pieces of evidence."""
        return replace(self, off={key: excess for key, excess in self.off.items() if self._piece(key) in pieces})

    def without(self, pieces: Collection[Piece]) -> Failures:
        """Return the failures that belong to none of these pieces of evidence."""
        return replace(self, off={key: excess for key, excess in self.off.items() if self._piece(key) not in pieces})

    def within(self, experiments: Collection[str]) -> Failures:
        """Return the failures within some experiments."""
        return replace(self, off={key: excess for key, excess in self.off.items() if key[0] in experiments})

    def _piece(self, key: Key) -> Piece:
        return Piece(key[2], EVIDENCE[key[:2]], self.off[key] > 0)
