"""Outcomes of campaigns as they would be, without running a hand."""

from dataclasses import replace

import numpy as np

from aero.firmware import VERSION_GROUPS
from hil.checks import CHECKS
from train.campaign.trial import Outcome, healthy_hands, shipped_hands


def numbers(value=0.0, **changed):
    """Return every judged number of a run, all `value` but for `changed`: `experiment__metric__subject=...`."""
    found = {}
    for check in CHECKS:
        for subject in check.subjects:
            row = found.setdefault(check.experiment, {}).setdefault(subject, {})
            row[check.metric] = max(value, check.at_least) if check.given else value
    for name, other in changed.items():
        experiment, metric, subject = name.split("__")
        found[experiment][subject][metric] = other
    return found


def outcome(trial, **more):
    """Return a run that ended well with all its numbers."""
    return replace(Outcome(trial, numbers(), (), "", "", 10.0, 9.0, 192.0, commit="abc"), **more)


def healthy_campaign(count=24, seed=0):
    """Return healthy outcomes of every group of firmware and the shipped units, normally spread."""
    draw = np.random.default_rng(seed)
    trials = [*shipped_hands(), *(t for group in VERSION_GROUPS for t in healthy_hands(50, count, group[-1:]))]
    found = []
    for trial in trials:
        table = numbers()
        for rows in table.values():
            for row in rows.values():
                for metric in row:
                    row[metric] += float(draw.normal(0.0, 0.01))
        found.append(outcome(trial, numbers=table))
    return found
