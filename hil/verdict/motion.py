"""Exclusion of channels without motion from metrics that need motion."""

import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import replace

from aero.channels import Channel
from hil.checks import Measured, metric_of
from hil.checks.shared.declaration import MotionRole
from hil.checks.shared.experiment import reading
from hil.checks.shared.subjects import CHANNELS
from hil.verdict.findings import Finding, NotJudgedReason, Withheld
from hil.verdict.judged_run import Result, Validation
from hil.verdict.limits import Limit

STILL = 0.05
"""Fraction of the smallest healthy distance; a channel below it in every measurement has no motion.

A jammed gear still creeps that far when its goal changes.
"""


def still_channels(numbers: Mapping[str, Measured], limits: Collection[Limit]) -> frozenset[Channel]:
    """Return the channels without motion; channels without a measured motion are not included."""
    moved: dict[str, list[bool]] = {}
    for limit in limits:
        for subject in limit.subjects:
            if limit.healthy is None or role_of(limit.experiment, limit.metric, subject) is not MotionRole.MEASURED:
                continue
            value = reading(numbers.get(limit.experiment, {}), subject, limit.metric)
            if value is not None and math.isfinite(value):
                moved.setdefault(subject, []).append(abs(value) >= STILL * limit.healthy[0])
    return frozenset(Channel(CHANNELS.index(subject)) for subject, found in moved.items() if not any(found))


def role_of(experiment: str, metric: str, subject: str) -> MotionRole | None:
    """Return a metric's relation to motion, or None (also for findings without a metric)."""
    found = metric_of(experiment, metric, subject)
    return None if found is None else found.motion


def without_motion(run: Validation, still: Collection[Channel]) -> Validation:
    """Withhold the metrics that need motion on channels without motion.

    Metrics of the whole hand need all channels, so they are withheld too if they could not be measured.
    """
    labels = {channel.label for channel in still}

    def applies(finding: Finding) -> bool:
        role = role_of(finding.experiment, finding.check, finding.subject)
        if role is MotionRole.NEEDED_OF_ALL:
            return not labels
        needs = role is MotionRole.NEEDED
        whole = finding.subject == "hand" and finding.excess is None and bool(labels)
        return not (needs and (finding.subject in labels or whole))

    alike = None if run.alike is None else _kept(run.alike, applies)
    return replace(run, results={name: _kept(result, applies) for name, result in run.results.items()}, alike=alike)


def _kept(result: Result, applies: Callable[[Finding], bool]) -> Result:
    gone = [finding for finding in result.findings if not applies(finding)]
    more = tuple(Withheld(one.experiment, one.check, one.subject, one.name, NotJudgedReason.NO_MOTION) for one in gone)
    kept = tuple(finding for finding in result.findings if applies(finding))
    return replace(result, findings=kept, withheld=(*result.withheld, *more)) if gone else result
