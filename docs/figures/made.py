"""All that is made, and whether it is up to date: inputs as they were, or a sample remade from them that is equal."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass, replace
from functools import cache
from importlib import import_module
from multiprocessing import get_context

import mujoco

from figures import differences
from figures.inputs import ROOT, changed, closure, digest, digests, traced
from figures.results import Rows, Shipped, Stored, load, store

MODULES = (
    "actuation_map", "hand_model", "electronics", "safety", "validation", "campaign", "diagnosis", "calibration",
    "commands", "limits", "policy", "correction", "cables", "pictures",
)  # fmt: skip
"""Modules of this package whose `TABLES` measure tables of the page of their name, and whose `SHIPPED` files ship."""
OURS = {ROOT / "docs" / "figures" / f"{name}.py" for name in ("__init__", "inputs", "made", "results")}
"""Modules that note inputs and determine no number."""
MUJOCO = ".".join(mujoco.__version__.split(".")[:2])
ANOTHER_MUJOCO = 0.06
"""Relative tolerance of a figure that another version of MuJoCo has measured."""


@dataclass(frozen=True)
class Made:
    """Something that is made."""

    by: Shipped
    """Its files, none of a table, with the sample."""
    table: Callable[[], Rows] | None = None
    """Measures the table of a page."""


@cache
def everything() -> dict[str, Made]:
    """Return all that is made, by the name of its file in `stored/`."""
    return {name: one for module in MODULES for name, one in of_module(module).items()}


def of_module(name: str) -> dict[str, Made]:
    """Return what a module of this package makes."""
    module = import_module(f"figures.{name}")
    samples = getattr(module, "SAMPLES", {})
    tables = {one.__name__: Made(Shipped((), (), samples.get(one, one)), one) for one in getattr(module, "TABLES", ())}
    shipped = {key: Made(one) for key, one in getattr(module, "SHIPPED", {}).items()}
    return {f"{name}.{key}": one for key, one in (tables | shipped).items()}


def remade(module: str, names: Collection[str]) -> dict[str, tuple[Rows, dict[str, str]]]:
    """Return the samples of a module and the inputs of each; to be called once in a process.

    What one sample of the module reads counts as an input of the others, too.
    """

    def samples() -> dict[str, Rows]:
        # No other module of this package is imported here, because what is imported counts as an input.
        once = cache(lambda sample: sample())
        return {name: once(one.by.sample) for name, one in of_module(module).items() if name in names}

    found, used = traced(samples)
    of = {name: of_module(module)[name].by for name in found}
    closures = {name: closure((f"figures.{module}", *one.maker)) for name, one in of.items()}
    outputs = {name: {ROOT / file for file in one.files} for name, one in of.items()}
    return {name: (rows, digests((used | closures[name]) - OURS - outputs[name])) for name, rows in found.items()}


def sampled(names: Iterable[str], workers: int) -> Iterator[tuple[str, Stored]]:
    """Remake samples, those of a module in a process of its own; store and yield what is found of each."""
    of_modules: dict[str, list[str]] = {}
    for name in names:
        of_modules.setdefault(name.partition(".")[0], []).append(name)
    context = get_context("spawn")  # a forked process has read data already, which then is no input
    with ProcessPoolExecutor(workers, mp_context=context, max_tasks_per_child=1) as pool:
        running = {pool.submit(remade, module, some): some for module, some in of_modules.items()}
        for future in as_completed(running):
            error, samples = future.exception(), {} if future.exception() else future.result()
            for name in running[future]:
                found = _compared(name, samples[name]) if error is None else _broken(name, error)
                if edited := changed(found.outputs):
                    found = replace(found, differs=f"{', '.join(edited)} was not made by `python -m figures {name}`")
                store(name, found)
                yield name, found


def _compared(name: str, sample: tuple[Rows, dict[str, str]]) -> Stored:
    rows, inputs = sample
    before = load(name)
    return replace(before, differs=difference(name, before, rows), inputs=inputs)


def _broken(name: str, error: BaseException) -> Stored:
    """Return what is stored, with the error that ended the sample and the inputs as they are."""
    before = load(name)
    present = [ROOT / one for one in before.inputs if (ROOT / one).is_file()]
    said = f"the sample ended with {type(error).__name__}: {error}"
    return replace(before, differs=said, inputs=digests(present))


def difference(name: str, stored: Stored, rows: Rows) -> str:
    """Return how a sample differs from what is stored; empty if it is equal."""
    made = everything()[name]
    expected = made.by.shipped() if made.by.shipped else stored.sample or stored.rows
    if not expected or (made.table and not (stored.sample or _part(stored, rows))):
        return "no sample was stored when it was made"
    found = list(differences(expected, rows, 0.0 if stored.mujoco == MUJOCO else ANOTHER_MUJOCO))
    return f"{len(found)} of {len(rows) - 1} rows differ; {found[0]}" if found else ""


def _part(stored: Stored, rows: Rows) -> bool:
    """Return whether a sample is a part of the stored table."""
    return set(rows[0]) <= set(stored.rows[0])


def make(name: str) -> Stored:
    """Measure a table whole, or write files that ship; store it with a new sample."""
    made, before = everything()[name], load(name)
    if made.by.make:
        made.by.make()
    digest.cache_clear()
    found = Stored(
        before.command,
        rows=made.table() if made.table else (),
        mujoco=MUJOCO,
        outputs=digests(ROOT / one for one in made.by.files),
    )
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        rows, inputs = pool.submit(remade, name.partition(".")[0], [name]).result()[name]
    contained = made.by.shipped is not None or (found.rows and _part(found, rows))
    found = replace(found, sample=() if contained else rows, inputs=inputs)
    found = replace(found, differs=difference(name, found, rows))
    store(name, found)
    return found
