"""What `aero-hil validate` does; apart from its options, because it loads a physics engine and a plotting library."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NoReturn

import click
import numpy as np
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.progress import BarColumn, TaskProgressColumn, TimeRemainingColumn
from rich.table import Table
from rich.text import Text

from aero.safety import SafetyStopError
from hil.checks import DEFAULT, EXPERIMENTS
from hil.cli.before_moving import before_moving
from hil.cli.exits import Ended, Exit, ending, usage_errors
from hil.cli.options import ChosenHand
from hil.cli.terminal import ProgressBar, description
from hil.cli.terminal import console as new_console
from hil.cli.viewing import Audience, telling, viewing
from hil.faults import FaultNeverFiredError, parse_fault
from hil.recordings.output import emptied, prepared_folder, run_folder
from hil.report.beside_paper import compared, table
from hil.report.evidence import first_seen
from hil.report.results import write_figures, write_results
from hil.targets.target import Onlooker, Question
from hil.verdict.baseline import load
from hil.verdict.findings import failed
from hil.verdict.judged_run import Result, Validation
from hil.verdict.run_end import ended_at_closing
from hil.verdict.validation import validate as run_validation
from hil.view.sources import source_of

SHORT_TITLES = {"Thumb abduction": "Abd.", "Thumb CMC flexion": "CMC", "Thumb flexor": "Flexor"}
"""For a terminal of 80 columns."""


def run(
    hand: ChosenHand,
    names: Sequence[str],
    *,
    baseline: Path | None,
    homed: bool,
    faults: Sequence[str],
    view: bool,
    dry_run: bool,
    out: Path | None,
) -> None:
    """Validate the chosen hand, show the result and end the program with its exit code.

    Args:
        hand: what to open.
        names: experiments to run; the default ones when empty.
        baseline: folder of the hand's earlier figures.
        homed: whether an emulated hand is homed first.
        faults: what is put into an emulated hand, as `hil.faults` writes it.
        view: show the hand in a web page.
        dry_run: read and show only.
        out: folder of the results; one named by the time when None.
    """
    console = new_console()
    columns = (description(28), BarColumn(), TaskProgressColumn(), TimeRemainingColumn())
    with usage_errors():
        if baseline is not None:
            load(baseline)
        opening = hand.open(homed=homed, faults=[parse_fault(text) for text in faults])
        folder = None if dry_run else prepared_folder(out) if out is not None else run_folder(Path("validation"))
        if folder is not None and (folder / "checks.json").exists():
            console.print(f"the results in {folder} are replaced")
    result: Validation | None = None
    with viewing(view, hand) as audience:
        try:
            asking = any(EXPERIMENTS[name].asks for name in names)
            # A bar that moves would draw over the questions.
            bars = ProgressBar(*columns, console=console, transient=True, disable=asking)
            with emptied(folder), opening as alone, bars as bar:
                onlookers = (Onlooker(ask_on_terminal),) if asking else ()
                opened = replace(alone, capabilities=(*alone.capabilities, *onlookers))
                audience.follow(source_of(opened))
                if dry_run or opened.guard is not None:
                    console.print(before_moving(opened, _furthest(names or DEFAULT)))
                if folder is None:
                    return
                task = bar.add_task("opening", total=1.0)

                def kept(so_far: Validation) -> None:
                    write_figures(so_far, folder)
                    name, ran = list(so_far.results.items())[-1]
                    audience.note(f"{name}: {len(failed(ran.findings))} of {len(ran.findings)} checks failed")
                    _show(so_far, audience)

                result = run_validation(
                    opened,
                    names or DEFAULT,
                    baseline=baseline,
                    folder=folder,
                    progress=telling(audience, lambda done, doing: bar.update(task, completed=done, description=doing)),
                    on_result=kept,
                )
        # Known only when the hand is closed; what was measured stands.
        except (FaultNeverFiredError, SafetyStopError) as error:
            if result is None or folder is None:
                raise
            result = replace(result, end=ended_at_closing(result.end, error))
        _show(result, audience)
        print_run(console, result, folder)
        write_results(result, folder)
    _end(result, folder)


def _show(result: Validation, audience: Audience) -> None:
    failures = failed(result.findings)
    audience.verdicts(len(result.findings) - len(failures), [finding.sentence for finding in failures])


def _end(result: Validation, folder: Path) -> NoReturn:
    """Leave with the exit code of the run."""
    if result.end.error is None:
        sys.exit(Exit.WITHIN_LIMITS if result.passed else Exit.OUT_OF_LIMITS)
    if isinstance(result.end.error, SystemExit):
        click.echo(f"what was recorded is in {folder}", err=True)
        raise result.end.error
    code, line = ending(result.end.error)
    raise Ended(f"{line}; what was recorded is in {folder}", code)


def _furthest(names: Sequence[str]) -> Sequence[float]:
    """Return how far each channel is sent at most, (7,) share of its window."""
    return tuple(np.max([EXPERIMENTS[name].furthest for name in names], axis=0))


def print_run(console: Console, result: Validation, out: Path) -> None:
    """Print a run for a terminal, which shows its end: what is told first on the page comes last here."""
    if (beside := compared(result)) is not None:
        console.print(_table(beside))
    for name, ran in result.results.items():
        bad = len(failed(ran.findings))
        verdict = (f"{bad} of {len(ran.findings)} failed", "bold") if bad else f"{len(ran.findings)} checks passed"
        console.print(Text.assemble(f"{name:10} {EXPERIMENTS[name].title}: ", verdict))
    failures = failed(result.findings)
    for line in told(result):
        console.print(line)
    if result.remark:
        console.print(result.remark)
    verdict = f"{len(failures)} of {len(result.findings)} checks failed" if failures else "within limits"
    console.print(
        f"{verdict}; {result.hand_seconds:.0f} s of hand time in {result.wall_seconds:.1f} s; {out / 'report.html'}"
    )


def _table(result: Result) -> Table:
    rows = table(result)
    title = f"Simulator and hand on one {result.recording.header.experiment}; mm, abduction in mrad, rise in ms"
    shown = Table("Channel", title=title, title_justify="left", box=SIMPLE_HEAD, padding=(0, 1))
    for cell in rows[0].cells:
        shown.add_column(cell.short, justify="right")
    for row in rows:
        shown.add_row(SHORT_TITLES.get(row.title, row.title), *(c.ours for c in row.cells))
        shown.add_row("  paper", *(cell.paper for cell in row.cells), style="dim")
    return shown


def ask_on_terminal(question: Question) -> str:
    """Ask until there is an answer that fits.

    Raises:
        KeyboardInterrupt: at the end of the input, and on Ctrl-C.
    """
    click.echo(question.text)
    try:
        answer = click.prompt(question.legend, type=click.Choice(list(question.answers)), show_choices=False)
    except click.Abort as error:
        raise KeyboardInterrupt from error
    return question.answers[answer]


def told(validation: Validation) -> Iterator[Text]:
    """Yield a line for each thing that a person is told; none for a run in which nothing failed."""
    diagnosis = validation.diagnosis
    for withheld in validation.withheld:
        yield _line("grey", withheld.sentence)
    for finding in diagnosis.unexplained:
        yield _line("failed", f"{finding.sentence}. {finding.meaning} {finding.remedy}")
    for indication in diagnosis.evidence:
        yield _line("failed", f"{indication.finding.sentence}. {indication.finding.meaning}")
    if diagnosis.location:
        yield _line("where", diagnosis.location.words)
    if since := first_seen(validation):
        yield _line("when", since.sentence)
    if diagnosis.location:
        yield _line("what", diagnosis.sentence)
    if diagnosis.step:
        yield _line("do this", diagnosis.step.do)
        if diagnosis.step.command:
            yield Text(f"        {diagnosis.step.command}")


def _line(label: str, text: str) -> Text:
    return Text.assemble((f"{label:7}", "bold"), " ", text.replace("`", ""))
