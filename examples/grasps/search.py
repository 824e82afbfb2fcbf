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
from .variables import HIGH, LOW, SCALES, Vector, grasp_of, vector_of

ROUGH_TRIES = 80
"""Before CMA-ES begins, on the first hand alone."""
ROUNDS = ((5, 6), (2, 15), (1, 60))
"""Of how many runs of CMA-ES the best go on, and for how many generations; successive halving."""
SPREAD = 0.06
"""First standard deviation of CMA-ES: a closure by 6 %, a place by 5 mm, a direction by 7°."""
ROUGH_SPREAD = 0.12
POPULATION = 14
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
    best, tries = Found(replace(start, margin=None), worth(start, units), 1), 1
    yield best
    while True:
        rough = [vector_of(best.grasp), *(_rough(best.grasp, units[0], random) for _ in range(ROUGH_TRIES))]
        ranked = sorted(rough, key=lambda vector: -worth(grasp_of(vector, start), units[:1]))
        tries += len(rough)
        yield replace(best, tries=tries)
        runs = [_run(vector, int(random.integers(1, 2**31))) for vector in ranked[: ROUNDS[0][0]]]
        for survivors, generations in ROUNDS:
            runs = sorted(runs, key=lambda run: run.best.f if run.best.f is not None else np.inf)[:survivors]
            for run in runs:
                stale = 0
                for _ in range(generations):
                    vectors = run.ask()
                    grasps = [grasp_of(vector, start) for vector in vectors]
                    worths = [worth(grasp, units) for grasp in grasps]
                    before = run.best.f if run.best.f is not None else np.inf
                    run.tell(vectors, [-value for value in worths])
                    tries += len(worths)
                    first = int(np.argmax(worths))
                    stale = 0 if -worths[first] < before else stale + 1
                    if worths[first] > best.worth:
                        best = Found(grasps[first], worths[first], tries)
                    best = replace(best, tries=tries)
                    yield best
                    if stale >= GIVES_UP:
                        break


def _run(vector: Vector, seed: int) -> cma.CMAEvolutionStrategy:
    options = {"bounds": [LOW, HIGH], "popsize": POPULATION, "seed": seed, "verbose": -9}
    return cma.CMAEvolutionStrategy(np.clip(vector, LOW, HIGH), SPREAD, options)


def _rough(grasp: Grasp, unit: Unit, random: np.random.Generator) -> Vector:
    """Draw a posture: near the one that is known, or any, with the object where the digits meet."""
    vector = vector_of(grasp)
    vector += ROUGH_SPREAD * random.standard_normal(vector.size)
    if random.random() < 0.3:
        return vector
    closing = [channel in grasp.closing for channel in Channel]
    # Abduction is drawn too: it decides which finger the thumb meets.
    closing[Channel.THUMB_ABDUCTION] = "thumb" in grasp.touching
    closure = np.where(closing, random.uniform(0.1, 1.0, len(Channel)), vector[: len(Channel)])
    vector[: len(Channel)] = closure
    drawn = grasp_of(vector, grasp)
    centre = meeting_mm(drawn, unit) + 8.0 * random.standard_normal(3)
    vector[-6:-3] = centre / SCALES[-6:-3]
    return vector
