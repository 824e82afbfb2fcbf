"""What is known of faults, and how far it can be trusted: the one thing that a diagnosis compares a run with."""

from __future__ import annotations

import json
from bisect import bisect_right
from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from functools import cache
from importlib import resources

import numpy as np

from hil.verdict.causes import CAUSES
from hil.verdict.deviation import deviation
from hil.verdict.dictionary import load_dictionary
from hil.verdict.explanation import Diagnosis, Effect, Explanation, LikelyEffect, Place
from hil.verdict.likeness import Known, Likeness
from hil.verdict.signature import Places
from hil.verdict.whereabouts import Placing, whereabouts

FILE = "places.json"
MISSED = 0.1
"""Share of the runs of known causes whose cause the shown set may leave out."""


@dataclass(frozen=True)
class Trust:
    """How far the answers of a dictionary can be trusted, learned from hands and kinds that it had not seen."""

    explained: tuple[float, ...]
    """What the right cause explained of hands that the dictionary had not seen, rising."""
    sharpness: float
    """Difference in what causes explain over which their likelihood falls to 1/e."""
    believed: tuple[float, float]
    """Slope and constant of the logistic share with which the best explanation belongs to a known cause at all."""

    def shows(self, likeness: Likeness) -> bool:
        """Return whether a cause explains as much as the right one does on 9 of 10 hands: split conformal prediction.

        With n hands the right cause is shown with a probability of at least 1 - `MISSED`, if the run is of a cause
        that is known and its hand is drawn as theirs were (Vovk, Gammerman, Shafer: Algorithmic Learning in a Random
        World, 2005).
        """
        return (1 + bisect_right(self.explained, likeness.explained)) / (len(self.explained) + 1) > MISSED

    def known(self, explained: float) -> float:
        """Return how likely a run is of a known cause when the best explains so much of it."""
        slope, constant = self.believed
        return float(1.0 / (1.0 + np.exp(-(slope * explained + constant))))


@dataclass(frozen=True)
class Reference:
    """Known faults, a model of the places, and how far both can be trusted."""

    known: Known
    placing: Placing
    trust: Trust

    def diagnosed(self, found: Places) -> Diagnosis:
        """Return where something is wrong in a run, what kind of effect it has, and which causes fit, without words.

        Args:
            found: places of the run's readings, and of its ending.
        """
        run = deviation(found, self.placing.usual)
        likely = _best_seats(self.known.explained(run))
        where = self.placing.shares(run)
        shares = self._shares(likely, where)
        believed = self.trust.known(likely[0].explained) if likely else 0.0
        effects: dict[Effect, float] = defaultdict(float)
        for one in likely:
            effects[CAUSES[one.cause][1]] += shares[one.cause]
        ranked = sorted(likely, key=lambda one: (-shares[one.cause], one.cause))
        return Diagnosis(
            whereabouts(run, where),
            tuple(LikelyEffect(effect, share) for effect, share in _ranked(effects)),
            tuple(Explanation(one.cause, one.channel, believed * shares[one.cause], one.fault) for one in ranked),
            tuple(one.cause for one in ranked if self.trust.shows(one)),
        )

    def _shares(self, likely: Iterable[Likeness], where: Mapping[Place, float]) -> dict[str, float]:
        """Return how likely each cause is if it is one of those that are known; they add up to one.

        Each place has its share, and its causes divide it by what they explain.
        """
        weights = {one.cause: float(np.exp(one.explained / self.trust.sharpness)) for one in likely}
        totals: dict[Place, float] = defaultdict(float)
        for cause, weight in weights.items():
            totals[CAUSES[cause][0]] += weight
        known = sum(where.get(place, 0.0) for place in totals) or 1.0
        return {
            cause: where.get(CAUSES[cause][0], 0.0) / known * weight / totals[CAUSES[cause][0]]
            for cause, weight in weights.items()
        }


def _best_seats(likely: Iterable[Likeness]) -> list[Likeness]:
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
    trust = Trust(tuple(table["explained"]), table["sharpness"], tuple(table["believed"]))
    return Reference(Known(load_dictionary(), table["usual"]), Placing(table["usual"], weights), trust)


def reference_text(placing: Placing, trust: Trust, provenance: Mapping[str, str | int | list[str]]) -> str:
    """Return what `load_reference` needs besides the dictionary, as JSON."""
    weights = {place.value: dict(row) for place, row in placing.weights.items()}
    table = {"provenance": provenance, "usual": dict(placing.usual), "weights": weights, **asdict(trust)}
    return json.dumps(table, indent=1) + "\n"
