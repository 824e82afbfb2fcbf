"""Synthetic outcomes of campaigns."""

from dataclasses import replace

from hil.checks import CHECKS
from train.campaign.trial import Outcome


def numbers(value=0.0, **changed):
    """Return every judged number of a run, all `value` except `changed`: `experiment__metric__subject=...`."""
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
    """Return a completed run with all its numbers."""
    return replace(Outcome(trial, numbers(), (), "", "", 10.0, 192.0, commit="abc"), **more)
