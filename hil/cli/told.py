"""What a person is told on the terminal: before a hand moves, and about a run that failed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from rich.box import SIMPLE_HEAD
from rich.table import Table
from rich.text import Text

from aero.channels import Channel
from aero.safety import Thresholds
from hil.checks.shared.subjects import subject_words
from hil.targets.target import Target
from hil.verdict.judged_run import Validation
from hil.verdict.next_step import cause_words, on_hand
from hil.verdict.run_summary import header_of, summary_of

CAUSES = 3
"""That are told."""


def told(validation: Validation) -> Iterator[Text]:
    """Yield a line for each thing that is told; none for a run in which nothing failed."""
    summary, header = summary_of(validation), header_of(validation)
    for finding in summary.unexplained:
        yield _line("failed", f"{finding.sentence}. {finding.meaning} {finding.remedy}")
    if summary.likeliest:
        for finding in summary.explained:
            yield _line("failed", f"{finding.sentence} ({cause_words(summary.likeliest.cause)})")
    for cause in summary.causes[:CAUSES]:
        where = "hand" if cause.channel is None else subject_words(cause.channel.label)
        look = on_hand(cause.next_look, header) if header else cause.next_look
        share = f"{cause.probability:.0%} {cause_words(cause.cause)} ({where}): {cause.meaning} {look}"
        yield _line("perhaps", share)
    if summary.where:
        yield _line("where", summary.where)
    if summary.likeliest:
        yield _line("likely", f"{cause_words(summary.likeliest.cause)}, {summary.likeliest.probability:.0%}")
    elif summary.unlike:
        yield _line("likely", "none of the known causes: unlike every fault that was tried")
    if summary.step:
        yield _line("do this", summary.step.do)
        if summary.step.command:
            yield Text(f"        {summary.step.command}")


def _line(label: str, text: str) -> Text:
    return Text.assemble((f"{label:7}", "bold"), " ", text.replace("`", ""))


def before_moving(target: Target, furthest: Sequence[float]) -> Table:
    """Return what a hand reads now, how far each channel is about to be sent, and what would stop it.

    Args:
        target: the hand; nothing is commanded.
        furthest: (7,) share of each channel's window, command order.

    Raises:
        SafetyStopError: a guarded hand is too hot to move, or holds against something.
    """
    guard = target.guard
    if guard is None:
        currents, temperatures, thresholds = target.hand.read_currents(), target.hand.read_temperatures(), Thresholds()
    else:
        health, thresholds = guard.check(), guard.thresholds
        currents, temperatures = health.currents_a, health.temperatures_c
    stops = ", ".join(f"{name} {value:g}" for name, value in thresholds.as_dict().items())
    shown = Table(
        "Channel", "now, A", "now, °C", "will move to, % of window", box=SIMPLE_HEAD, title_justify="left",
        title=f"{target.describe()}, {'not guarded' if guard is None else 'guarded'}. Thresholds of the guard: {stops}",
    )  # fmt: skip
    for channel in Channel:
        shown.add_row(
            channel.label,
            f"{currents[channel]:+.2f}",
            f"{temperatures[channel]:.0f}",
            f"{100 * furthest[channel]:.0f}",
        )
    return shown
