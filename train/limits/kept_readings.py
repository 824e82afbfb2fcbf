"""Readings of three hands that shipped data were made from, kept beside the data to tell when they are out of date.

Hands that are measured again read the same to within the check's floor, the least distance of a limit from any healthy
reading: no two hands are told apart by less. What moved further was changed by the code or by a unit.
"""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from aero.whole_file import write_whole
from hil.checks.shared.declaration import Check
from hil.recordings.output import prepared_folder
from train.campaign.trial import Outcome, Trial

FOLDER = "hands"
"""Beside the limits; one file for each kind of hand."""
ROUNDED = 1.001
"""Room for the rounding of what is kept: some readings come in steps of just the floor."""
Numbers = Mapping[str, Mapping[str, Mapping[str, float]]]
"""Experiment to subject to metric to value."""


@dataclass(frozen=True)
class Kept:
    """What one hand read when the data were made."""

    trial: Trial
    commit: str
    """Of the source that it was measured with."""
    numbers: Numbers

    def moved(self, outcome: Outcome, checks: Iterable[Check]) -> Iterator[str]:
        """Yield a line for each reading, measured both times, that moved by more than the floor of its check."""
        if outcome.stopped:
            yield f"{self.trial.key}: {outcome.stopped}"
        for check in checks:
            meant = not check.given and self.trial.firmware in (check.firmware or (self.trial.firmware,))
            for subject in check.subjects if meant else ():
                before, now = (_reading(found, check, subject) for found in (self.numbers, outcome.numbers))
                if before is None or now is None:
                    continue
                if math.isnan(before) != math.isnan(now) or abs(now - before) > check.floor * ROUNDED:
                    yield (
                        f"{self.trial.key}: {check.experiment}/{check.metric}/{subject} read {before:.5g} at "
                        f"{self.commit}, reads {now:.5g}; healthy hands are told apart from {check.floor:g} on"
                    )


def _reading(numbers: Numbers, check: Check, subject: str) -> float | None:
    return numbers.get(check.experiment, {}).get(subject, {}).get(check.metric)


def kept(outcomes: Iterable[Outcome]) -> tuple[Kept, ...]:
    """Return what is kept of a campaign: of hands in the order of their keys the first, the middle and the last."""
    ordered = sorted(outcomes, key=lambda outcome: outcome.trial.key)
    chosen = sorted({0, len(ordered) // 2, len(ordered) - 1}) if ordered else []
    return tuple(Kept(hand.trial, hand.commit, hand.numbers) for hand in (ordered[place] for place in chosen))


def write_kept(out: Path, name: str, outcomes: Iterable[Outcome]) -> None:
    """Write what is kept of a campaign beside the data in `out`, for a kind of hand.

    Raises:
        OSError: the folder cannot be made.
    """
    write_whole(prepared_folder(out / FOLDER) / f"{name}.json", kept_text(kept(outcomes)))


def kept_text(hands: Iterable[Kept]) -> str:
    """Return hands as JSON, the readings of an experiment on one line for each subject."""
    tables = [
        {
            "trial": dataclasses.asdict(hand.trial),
            "commit": hand.commit,
            "numbers": {
                experiment: {
                    subject: {metric: float(f"{value:.7g}") for metric, value in metrics.items()}
                    for subject, metrics in subjects.items()
                }
                for experiment, subjects in hand.numbers.items()
            },
        }
        for hand in hands
    ]
    return json.dumps({"hands": tables}, indent=1) + "\n"


def parse_kept(text: str) -> tuple[Kept, ...]:
    """Return the hands of a file that `kept_text` wrote."""
    return tuple(
        Kept(Trial.of(table["trial"]), table["commit"], table["numbers"]) for table in json.loads(text)["hands"]
    )
