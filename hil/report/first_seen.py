"""When in a run something was first seen to be off, and whether it began in the run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from hil.recordings.recording import Recording
from hil.report.evidence import by_finding
from hil.verdict.explained import missed
from hil.verdict.explanation import Explanation
from hil.verdict.findings import failed
from hil.verdict.judged_run import Validation


@dataclass(frozen=True)
class FirstSeen:
    """The first finding of a run in time."""

    experiment: str
    seen_s: float
    """Since the hand was opened, s."""
    passed_until_s: float
    """End of the last experiment before it, s; all of those passed."""
    began_in_run: bool
    """Whether the likeliest cause would have been seen before, had it been there."""

    @property
    def sentence(self) -> str:
        """When, in words."""
        if self.began_in_run:
            between = f"between {self.passed_until_s:.0f} and {self.seen_s:.0f} s"
            return f"it began {between} after the start; this cause would have shown before, and nothing was off"
        return f"from {self.seen_s:.0f} s after the start on, in {self.experiment}; every check before passed"


def first_seen(validation: Validation, cause: Explanation | None) -> FirstSeen | None:
    """Return when something was first seen, None when the first experiment that moves the hand shows it already.

    Args:
        validation: the run.
        cause: its likeliest cause, None when none is known.
    """
    whole, results = validation.whole_run, validation.results
    if whole is None:
        return None
    starts = start_times(whole.recording, [result.recording for result in results.values()])
    names = sorted(starts, key=lambda name: starts[name])
    bad = next((i for i, name in enumerate(names) if failed(results[name].findings)), None)
    if bad is None or not any(_moves(results[name].recording) for name in names[:bad]):
        return None
    name, before = names[bad], names[:bad]
    seen = [where.start for where in by_finding(validation.judged).values() if where.experiment == name]
    ended = starts[before[-1]] + results[before[-1]].recording.header.duration_s
    began = cause is not None and missed(validation, cause, before)
    return FirstSeen(name, starts[name] + min(seen, default=0.0), ended, began)


def start_times(whole: Recording, parts: Sequence[Recording]) -> Mapping[str, float]:
    """Return when each experiment began, s since the hand was opened: where its bytes stand among those of the run.

    One whose bytes are not there is left out.
    """
    times, writes = _sent(whole)
    found: dict[str, float] = {}
    for part in parts:
        own_times, own = _sent(part)
        at = next((i for i in range(len(writes)) if own and writes[i : i + len(own)] == own), None)
        if at is not None:
            found[part.header.experiment] = times[at] - own_times[0]
    return found


def _sent(recording: Recording) -> tuple[list[float], list[bytes]]:
    sent = [record for record in recording.wire if record.direction == "to_hand"]
    return [record.t for record in sent], [record.data for record in sent]


def _moves(recording: Recording) -> bool:
    return "command_codes" in recording.series or "command" in recording.series
