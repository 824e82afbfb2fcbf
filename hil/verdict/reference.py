"""What is known of faults, and how far it can be trusted: the one thing that a diagnosis compares a run with."""

from __future__ import annotations

import json
import math
from bisect import bisect_right
from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cache
from importlib import resources

from hil.verdict.causes import CAUSES
from hil.verdict.deviation import deviation
from hil.verdict.dictionary import load_dictionary
from hil.verdict.explanation import Diagnosis, Effect, Explanation, LikelyEffect, Place
from hil.verdict.likeness import Known, Likeness
from hil.verdict.signature import Key, Places
from hil.verdict.whereabouts import Placing, whereabouts

FILE = "places.json"
UNSURE = 1e-3
"""Share that no place goes below, so that neither view alone rules one out."""
MISSED = 0.1
"""Share of the runs of known causes whose cause the shown set may leave out."""


@dataclass(frozen=True)
class Trust:
    """How far the answers of a dictionary can be trusted, learned from hands and kinds that it had not seen."""

    right: tuple[float, ...]
    """Share that the right cause had on hands that the dictionary had not seen, rising."""
    sharpness: float
    """Difference in what causes explain over which their likelihood falls to 1/e."""
    believed: tuple[float, float]
    """Slope and constant of the logistic share with which the best explanation belongs to a known cause at all."""

    def shows(self, share: float) -> bool:
        """Return whether a cause has a share that the right one has on 9 of 10 hands: split conformal prediction.

        The right cause is shown with a probability of at least 1 - `MISSED`, if the run is of a cause that is known and
        its hand is drawn as theirs were (Vovk, Gammerman, Shafer: Algorithmic Learning in a Random World, 2005).
        """
        return (1 + bisect_right(self.right, share)) / (len(self.right) + 1) > MISSED

    def known(self, explained: float) -> float:
        """Return how likely a run is of a known cause when the best explains so much of it."""
        slope, constant = self.believed
        return 1.0 / (1.0 + math.exp(-(slope * explained + constant)))


@dataclass(frozen=True)
class Reference:
    """Known faults, a model of the places, and how far both can be trusted."""

    known: Known
    placing: Placing
    trust: Trust

    def diagnosed(self, found: Places, excesses: Mapping[Key, float]) -> Diagnosis:
        """Return where something is wrong in a run, what kind of effect it has, and which causes fit, without words.

        Args:
            found: places of the run's readings, and of its ending.
            excesses: of its readings.
        """
        run = deviation(found, self.placing.usual, excesses)
        likely = best_seats(self.known.explained(run))
        expected = self.placing.shares(run)
        shares = cause_shares(likely, expected, self.trust.sharpness)
        believed = self.trust.known(likely[0].explained) if likely else 0.0
        by_place: dict[Place, float] = defaultdict(float)
        by_effect: dict[Effect, float] = defaultdict(float)
        for one in likely:
            place, effect = CAUSES[one.cause]
            by_place[place] += shares[one.cause]
            by_effect[effect] += shares[one.cause]
        ranked = sorted(likely, key=lambda one: (-shares[one.cause], one.cause))
        return Diagnosis(
            whereabouts(run, _both(expected, by_place)),
            tuple(LikelyEffect(effect, share) for effect, share in _ranked(by_effect)),
            tuple(Explanation(one.cause, one.channel, believed * shares[one.cause], one.fault) for one in ranked),
            tuple(one.cause for one in ranked if self.trust.shows(shares[one.cause])),
        )


def cause_shares(likely: Sequence[Likeness], expected: Mapping[Place, float], sharpness: float) -> dict[str, float]:
    """Return how likely each cause is if it is one of those that are known; they add up to one.

    Beforehand the causes of a place divide the root of its share; what a cause explains speaks for it.
    """
    of_place = Counter(CAUSES[one.cause][0] for one in likely)
    weights = {
        one.cause: math.sqrt(expected.get(CAUSES[one.cause][0], 0.0) + UNSURE)
        / of_place[CAUSES[one.cause][0]]
        * math.exp(one.explained / sharpness)
        for one in likely
    }
    total = sum(weights.values())
    return {cause: weight / total for cause, weight in weights.items()}


def _both(expected: Mapping[Place, float], by_cause: Mapping[Place, float]) -> dict[Place, float]:
    """Return the geometric mean of what the model of the places and the known causes say; it adds up to one."""
    shares = {
        place: math.sqrt((expected.get(place, 0.0) + UNSURE) * (by_cause.get(place, 0.0) + UNSURE)) for place in Place
    }
    total = sum(shares.values())
    return {place: share / total for place, share in shares.items()}


def best_seats(likely: Iterable[Likeness]) -> list[Likeness]:
    """Return each cause once, where it explains most; the best comes first."""
    best: dict[str, Likeness] = {}
    for one in likely:
        best.setdefault(one.cause, one)
    return list(best.values())


def _ranked(shares: Mapping[Effect, float]) -> list[tuple[Effect, float]]:
    return sorted(shares.items(), key=lambda pair: (-pair[1], pair[0].value))


@cache
def load_reference() -> Reference:
    """Return what ships."""
    table = json.loads((resources.files("hil") / "data" / FILE).read_text(encoding="utf-8"))
    weights = {Place(place): row for place, row in table["weights"].items()}
    trust = Trust(tuple(table["right"]), table["sharpness"], tuple(table["believed"]))
    return Reference(Known(load_dictionary(), table["usual"]), Placing(table["usual"], weights), trust)


def reference_text(placing: Placing, trust: Trust, provenance: Mapping[str, str | int | list[str]]) -> str:
    """Return what `load_reference` needs besides the dictionary, as JSON."""
    weights = {place.value: dict(row) for place, row in placing.weights.items()}
    table = {"provenance": provenance, "usual": dict(placing.usual), "weights": weights, **asdict(trust)}
    return json.dumps(table, indent=1) + "\n"
