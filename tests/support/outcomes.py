"""Synthetic outcomes of campaigns."""

from dataclasses import replace

from hil.checks import BOUNDS
from train.campaign.trial import Outcome


def numbers(value=0.0, **changed):
    """Return every judged number of a run, all `value` except `changed`: `experiment__metric__subject=...`."""
    found = {}
    for bound in BOUNDS:
        for subject in bound.subjects:
            row = found.setdefault(bound.experiment, {}).setdefault(subject, {})
            row[bound.metric] = max(value, bound.at_least) if bound.given else value
    for name, other in changed.items():
        experiment, metric, subject = name.split("__")
        found[experiment][subject][metric] = other
    return found


def outcome(trial, **more):
    """Return a completed run with all its numbers."""
    return replace(Outcome(trial, numbers(), (), "", "", 10.0, 192.0, commit="abc"), **more)
