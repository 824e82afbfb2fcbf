"""Summary of a campaign: flagged hands, detection by severity, suspected parts."""

from collections import defaultdict
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass

from jinja2 import Environment, PackageLoader, StrictUndefined

from hil.checks import ALIKE, Measured
from hil.emulated.faults import CATALOGUE, Injection, parse_fault
from hil.verdict.judge import Judge
from hil.verdict.limits import Key, excesses, load_limits, within_limits
from hil.verdict.run_end import FINISHED
from hil.verdict.suspects import isolate
from train.campaign.trial import Outcome, written
from train.share import Share

NOT_FIRED = "FaultNeverFiredError"


@dataclass(frozen=True)
class Detection:
    """Detection of one fault at one severity on several hands."""

    name: str
    severity: float
    unit: str
    found: Share
    checks: tuple[tuple[str, int], ...]
    """Failed `experiment/metric` with its number of hands, most frequent first."""
    located: int
    """Number of detected hands whose first suspect is the faulty part."""


def flagged(outcome: Outcome) -> bool:
    """Return whether the present limits flag the hand of a trial."""
    return bool(outcome.stopped) or not all(map(within_limits, judged(outcome).values()))


def judged(outcome: Outcome) -> dict[Key, float | None]:
    """Return the excesses of a trial over the present limits of its hand."""
    trial = outcome.trial
    limits = load_limits(trial.firmware, guarded=trial.guarded)
    return excesses(_numbers(outcome), limits)


def _numbers(outcome: Outcome) -> Mapping[str, Measured]:
    """Return the stored numbers, with the comparison of channels recomputed by the present program."""
    return {**outcome.numbers, ALIKE.name: ALIKE.measure(outcome.numbers)}


def told(outcome: Outcome) -> tuple[str, ...]:
    """Return the leading suspects of a flagged hand in the format of `Outcome.suspects`, diagnosed anew.

    For a run that ended with an error, the stored suspects are returned, because the error itself is not stored.
    """
    trial = outcome.trial
    if outcome.ended:
        return outcome.suspects
    judge = Judge(trial.firmware, guarded=trial.guarded)
    signs = judge.signs(_numbers(outcome), FINISHED)
    return tuple(sorted(map(written, isolate(signs).strong)))


def right_part(fault: Injection, suspects: Collection[str]) -> bool:
    """Return whether the suspects include the faulty part.

    A channel's servo and digit count as one part, since no run can separate them.
    """
    if fault.channel is not None and any(suspect.endswith(f"/{fault.channel.label}") for suspect in suspects):
        return True
    return not {part.name for part in fault.parts}.isdisjoint(suspects)


def detections(outcomes: Iterable[Outcome]) -> tuple[Detection, ...]:
    """Return a row for each fault and severity, in the order of the catalogue."""
    groups: dict[tuple[str, float], list[Outcome]] = defaultdict(list)
    for outcome in outcomes:
        if len(outcome.trial.faults) == 1 and outcome.ended != NOT_FIRED:
            fault = parse_fault(outcome.trial.faults[0])
            groups[fault.name, fault.severity].append(outcome)
    order = list(CATALOGUE)
    return tuple(
        _detection(name, severity, groups[name, severity])
        for name, severity in sorted(groups, key=lambda key: (order.index(key[0]), _rank(*key)))
    )


def _detection(name: str, severity: float, group: Sequence[Outcome]) -> Detection:
    failed: dict[str, int] = defaultdict(int)
    found = located = 0
    for outcome in group:
        if not flagged(outcome):
            continue
        found += 1
        for check in {f"{key[0]}/{key[1]}" for key, excess in judged(outcome).items() if not within_limits(excess)}:
            failed[check] += 1
        if outcome.stopped:
            failed[f"stopped: {outcome.ended or 'gate'}"] += 1
        fault = parse_fault(outcome.trial.faults[0])
        located += right_part(fault, told(outcome))
    ranked = tuple(sorted(failed.items(), key=lambda item: (-item[1], item[0])))
    unit = parse_fault(name).unit
    return Detection(name, severity, unit, Share(found, len(group)), ranked, located)


def false_alarms(outcomes: Iterable[Outcome]) -> tuple[Share, dict[str, int]]:
    """Return the share of flagged healthy hands and the alarm count of each check, `experiment/metric/subject`."""
    healthy = [outcome for outcome in outcomes if not outcome.trial.faults]
    by_check: dict[str, int] = defaultdict(int)
    for outcome in healthy:
        for key, excess in judged(outcome).items():
            if not within_limits(excess):
                by_check["/".join(key)] += 1
    return Share(sum(map(flagged, healthy)), len(healthy)), dict(by_check)


def _rank(name: str, severity: float) -> float:
    """Return the rank of a severity from mild to severe; for some faults, smaller numbers are more severe."""
    steps = CATALOGUE[name].steps()
    return severity if steps[-1] >= steps[0] else -severity


def render_campaign(outcomes: Sequence[Outcome]) -> str:
    """Return the HTML page of a campaign, without external resources."""
    healthy = [outcome for outcome in outcomes if not outcome.trial.faults]
    alarms, by_check = false_alarms(outcomes) if healthy else (None, {})
    rows = detections(outcomes)
    found = sum(row.found.count for row in rows)
    wall, hand = sum(o.wall_s for o in outcomes), sum(o.hand_s for o in outcomes)
    facts = f"{hand / 3600:.1f} hours of hand time in {wall / 3600:.2f} hours of work."
    if found:
        facts += (
            f" Of {sum(row.found.of for row in rows)} faulty hands {found} were found; of "
            f"{sum(row.located for row in rows)} the part at fault is suspected first."
        )
    environment = Environment(
        loader=PackageLoader("train.campaign"), autoescape=True, undefined=StrictUndefined, trim_blocks=True
    )
    return environment.get_template("campaign.html.j2").render(
        runs=len(outcomes),
        facts=facts,
        alarms="" if alarms is None else str(alarms),
        by_check=sorted(by_check.items(), key=lambda item: -item[1]),
        rows=rows,
    )
