"""Look for a posture with which a grasp holds: many rough tries, then CMA-ES from the best of them, fewer and fewer."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from zlib import crc32

import cma
import numpy as np

from aero.channels import Channel
from model.units import Unit

from .grasp import Grasp
from .rehearsal import meeting_mm, worth
from .variables import CENTRE, CLOSURE, HIGH, LOW, SCALES, Vector, grasp_of, vector_of

ROUGH_TRIES = 80
"""Before CMA-ES begins, on the first hand alone."""
ROUNDS = ((5, 6), (2, 15), (1, 60))
"""Of how many runs of CMA-ES the best go on, and for how many generations; successive halving."""
SPREAD = 0.06
"""First standard deviation of CMA-ES: a closure by 6 %, a place by 5 mm, a direction by 7°."""
ROUGH_SPREAD = 0.12
POPULATION = 14
NEAR = 0.3
"""Share of the rough tries near the posture that is known."""
SCATTER_MM = 8.0
"""How far the object is from where the digits meet, in the other rough tries."""
GIVES_UP = 10
"""A run that has not improved for so many generations is not gone on with."""


@dataclass(frozen=True)
class Found:
    """The best posture so far."""

    grasp: Grasp
    worth: float
    """As `rehearsal.worth`."""
    tries: int
    """How many postures were looked at until now."""


def search(start: Grasp, units: Sequence[Unit], seed: int = 0) -> Iterator[Found]:
    """Look for a better posture than `start` without end; give the best so far after each generation.

    The same start, units and seed give the same sequence.
    """
    # A search that goes on from what another found draws anew.
    random = np.random.default_rng([seed, start.number, crc32(repr(start).encode())])
    best, at = Found(replace(start, margin=None), worth(start, units), 1), vector_of(start)
    yield best
    while True:
        rough = [_rough(at, start, units[0], random) for _ in range(ROUGH_TRIES)]
        rough.sort(key=lambda vector: -worth(grasp_of(vector, start), units[:1]))
        best = replace(best, tries=best.tries + len(rough))
        yield best
        # The best so far is gone on with in any case: a person's good guess is worth more than many rough tries.
        runs = [Run(vector, start, int(random.integers(1, 2**31))) for vector in [at, *rough][: ROUNDS[0][0]]]
        for survivors, generations in ROUNDS:
            runs = sorted(runs, key=lambda run: -run.best)[:survivors]
            for run in runs:
                for _ in range(generations):
                    vector, grasp, reached = run.generation(units)
                    best = replace(best, tries=best.tries + POPULATION)
                    if reached > best.worth:
                        best, at = Found(grasp, reached, best.tries), vector
                    yield best
                    if run.stale >= GIVES_UP:
                        break


class Run:
    """One run of CMA-ES."""

    def __init__(self, vector: Vector, template: Grasp, seed: int) -> None:
        options = {"bounds": [LOW, HIGH], "popsize": POPULATION, "seed": seed, "verbose": -9}
        self._strategy = cma.CMAEvolutionStrategy(np.clip(vector, LOW, HIGH), SPREAD, options)
        self._template = template
        self.best = -np.inf
        """Worth of the best posture so far."""
        self.stale = 0
        """For how many generations nothing better was found."""

    def generation(self, units: Sequence[Unit]) -> tuple[Vector, Grasp, float]:
        """Look at one generation; return its best as a vector and as a grasp, and what that is worth."""
        vectors = self._strategy.ask()
        grasps = [grasp_of(vector, self._template) for vector in vectors]
        worths = [worth(grasp, units) for grasp in grasps]
        self._strategy.tell(vectors, [-reached for reached in worths])
        first = int(np.argmax(worths))
        self.stale = 0 if worths[first] > self.best else self.stale + 1
        self.best = max(self.best, worths[first])
        return np.array(vectors[first]), grasps[first], worths[first]


def _rough(at: Vector, template: Grasp, unit: Unit, random: np.random.Generator) -> Vector:
    """Draw a posture: near the one that is known, or any, with the object where the digits meet."""
    vector = at + ROUGH_SPREAD * random.standard_normal(at.size)
    if random.random() < NEAR:
        return vector
    closing = [channel in template.closing for channel in Channel]
    # Abduction is drawn too: it decides which finger the thumb meets.
    closing[Channel.THUMB_ABDUCTION] = "thumb" in template.touching
    vector[CLOSURE] = np.where(closing, random.uniform(0.1, 1.0, len(Channel)), vector[CLOSURE])
    met = meeting_mm(grasp_of(vector, template), unit) + SCATTER_MM * random.standard_normal(3)
    vector[CENTRE] = met / SCALES[CENTRE]
    return vector
