"""A metric is local: a copy of it under another name changes no sentence and no suspect."""

import ast
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hil.checks import EXPERIMENTS, JUDGED
from hil.verdict import failures, firmware_version
from hil.verdict.diagnosis import Diagnosis
from hil.verdict.judge import Judge
from hil.verdict.judged_run import Result, Validation
from hil.verdict.limits import compare, load_limits
from hil.verdict.run_end import FINISHED
from hil.verdict.sentences import channel_sentences
from hil.verdict.suspects import isolate

HANDS = json.loads((Path(__file__).parents[1] / "verdict" / "healthy_hands.json").read_text(encoding="utf-8"))
COPY = "renamed_copy"
RUNS = 6
METRICS = sorted({(name, metric.name) for name, measuring in JUDGED.items() for metric in measuring.metrics})


def drawn(seed):
    """Return the readings of a healthy hand with another version, or with some readings out of limits."""
    random, hand = np.random.default_rng(seed), HANDS[seed % len(HANDS)]
    numbers = {name: {on: dict(found) for on, found in table.items()} for name, table in hand["numbers"].items()}
    named = ("0.1.5", "0.2.0")[seed // len(HANDS) % 2]
    limits = [one for one in load_limits(named, guarded=hand["guarded"]) if one.experiment in numbers]
    for limit in random.choice(np.array(limits, object), seed % RUNS):
        for subject in random.choice(limit.subjects, 1 + random.integers(len(limit.subjects)), replace=False):
            if limit.metric in numbers[limit.experiment].get(subject, {}):
                ends = [end for end in (limit.at_least, limit.at_most) if np.isfinite(end)]
                numbers[limit.experiment][subject][limit.metric] = float(random.choice(ends)) * random.uniform(0.5, 2)
    return named, hand["guarded"], numbers


def said(named, guarded, numbers, limits):
    """Return what is said of a run without pictures: its suspects and clues, and the sentences of its channels."""
    judge = Judge(named, guarded=guarded)
    judge.limits = tuple(_kept(limits(named, guarded=guarded), numbers))
    isolation = isolate(judge.signs(numbers, FINISHED))
    results = {}
    for name, measured in numbers.items():
        findings, withheld = compare(JUDGED[name], measured, judge.limits, lambda subject, metric: 0.0)
        results[name] = Result(None, measured, findings, withheld)
    run = Validation(
        results, FINISHED, 0.0, diagnosis=Diagnosis(tuple(sorted(isolation.strong | isolation.weak, key=str)))
    )
    return isolation, channel_sentences(run)


def _kept(limits, numbers):
    """Yield limits of the readings that these runs have; a metric may be newer than they are."""
    for limit in limits:
        has = [one for one in limit.subjects if limit.metric in numbers.get(limit.experiment, {}).get(one, {})]
        if has:
            yield replace(limit, subjects=tuple(has))


def copied(monkeypatch, experiment, metric):
    """Add a copy of a metric with its limits; return the table of limits with it."""
    measuring = JUDGED[experiment]
    copies = [
        replace(one, name=COPY, bounds=tuple(replace(bound, metric=COPY) for bound in one.bounds))
        for one in measuring.metrics
        if one.name == metric
    ]
    with_copy = replace(measuring, metrics=(*measuring.metrics, *copies))
    for table in (JUDGED, EXPERIMENTS):
        if experiment in table:
            monkeypatch.setitem(table, experiment, with_copy)
    if (experiment, metric) in failures.EVIDENCE:
        monkeypatch.setitem(failures.EVIDENCE, (experiment, COPY), failures.EVIDENCE[experiment, metric])

    def limits(firmware, *, guarded=False):
        every = load_limits(firmware, guarded=guarded)
        own = (one for one in every if (one.experiment, one.metric) == (experiment, metric))
        return (*every, *(replace(one, metric=COPY) for one in own))

    monkeypatch.setattr(firmware_version, "load_limits", limits)
    return limits


@pytest.fixture(scope="module")
def before():
    return [(run, said(*run, load_limits)) for run in map(drawn, range(2 * RUNS))]


@pytest.mark.parametrize(("experiment", "metric"), METRICS)
def test_a_copy_under_another_name_changes_no_sentence(monkeypatch, before, experiment, metric):
    limits = copied(monkeypatch, experiment, metric)
    for (named, guarded, numbers), expected in before:
        more = {
            name: {
                on: found | ({COPY: found[metric]} if name == experiment and metric in found else {})
                for on, found in table.items()
            }
            for name, table in numbers.items()
        }
        assert said(named, guarded, more, limits) == expected


def test_the_runs_have_something_to_say(before):
    seen = {clue.seen for _, (isolation, _) in before for clue in isolation.clues}
    assert any("reads as firmware" in text for text in seen)
    assert len(seen) > 3


def test_no_other_module_names_a_metric():
    """Names of one word are those of series and tables, too."""
    names = {metric for _, metric in METRICS if "_" in metric}
    root = Path(__file__).parents[3]
    folders = ("hil", "train/limits", "train/campaign")
    others = (path for folder in folders for path in (root / folder).rglob("*.py") if "checks" not in path.parts)
    found = {
        (path.name, node.value)
        for path in others
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Constant) and node.value in names
    }
    assert found == set()
