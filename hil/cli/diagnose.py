"""`aero-hil diagnose`: which part of a hand that failed is at fault, step by step."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import click
from rich.progress import BarColumn

from aero.exit_code import Exit
from aero.whole_file import write_whole
from hil.checks import EXPERIMENTS
from hil.cli.exits import usage_errors
from hil.cli.options import open_hand
from hil.cli.output import echo
from hil.cli.terminal import ProgressBar, console, description
from hil.report.page import render_case
from hil.report.results import write_results
from hil.targets.hand_spec import HandSpec
from hil.verdict.case import DiagnosisCase, Proposal
from hil.verdict.case_file import HandOfCase, read_case, write_case
from hil.verdict.case_words import asked, came_of, conclusion, why
from hil.verdict.diagnosis import NextStep
from hil.verdict.findings import failed
from hil.verdict.rerun import AT_LEAST, rerun
from hil.verdict.run_end import EndKind
from hil.verdict.steps import StepOutcome

GO_ON = "Go on with the case that this run belongs to."


@click.command()
@click.argument(
    "folder", metavar="[CASE]", type=click.Path(exists=True, file_okay=False, path_type=Path),
    default="validation/latest",
)  # fmt: skip
@click.option("--hil", "port", metavar="TARGET", required=True, help="Port of the hand, or its name in hands.toml.")
def diagnose(*, folder: Path, port: str) -> None:
    """Isolate the part at fault of a hand that failed: the next step, then only what shows the failure, compared.

    CASE is the folder of the run that failed, validation/latest if not given; version and side are its own. Ctrl-C puts
    the case down; the same command takes it up. Exits with 0 when the failure is gone after the last step, and 1 when
    not.
    """
    out = console()
    with usage_errors():
        case, about = read_case(folder)
        hand = HandSpec.named(port, firmware=about.firmware, hand="left" if about.side == "left" else "right")
        if hand.in_software:
            raise click.UsageError("a person changes the hand between two runs; give its port with --hil")
    _keep(folder, case, about)
    for done in case.done:
        out.print(f"done       {came_of(done)}")
    while (proposal := case.next_step) is not None:
        out.print(f"why        {why(case, proposal)}")
        out.print(f"next step  {asked(proposal)}")
        try:
            outcome, note = _taken(hand, case, proposal, folder / f"step-{len(case.done) + 1}")
        except KeyboardInterrupt:
            out.print("the case is put down; the same command takes it up, at this step")
            raise
        if outcome is None:
            out.print("this run says nothing about the hand, as where this computer was busy; the step is asked again")
            continue
        case = case.after(proposal, outcome, note)
        _keep(folder, case, about)
        out.print(f"so         {outcome.value}{f' ({note})' if note else ''}")
    out.print(conclusion(case), style="bold")
    out.print(str(folder / "case.html"))
    sys.exit(Exit.WITHIN_LIMITS if case.gone else Exit.OUT_OF_LIMITS)


def _keep(folder: Path, case: DiagnosisCase, about: HandOfCase) -> None:
    write_case(folder, case, about)
    write_whole(folder / "case.html", render_case(case))


def _taken(hand: HandSpec, case: DiagnosisCase, proposal: Proposal, folder: Path) -> tuple[StepOutcome | None, str]:
    """Let a person do a step, and return what came of it with what the person noted.

    Raises:
        KeyboardInterrupt, SystemExit: at the end of the input, on Ctrl-C, and when told to stop.
    """
    note = ""
    try:
        if proposal.step.asks:
            seen = click.confirm("yes or no")
            note = str(click.prompt("what was measured or read", default="", show_default=False))
            if seen or not proposal.step.runs:
                return StepOutcome.SEEN if seen else StepOutcome.STAYS, note
        freed = proposal.step.frees and click.confirm("was there anything to take away")
        echo(f"runs       {_runs(case)}")
        homes = " homes and" if proposal.step.homes else ""
        ready = f"press Enter when it is done and the hand has power; it then{homes} moves, so keep clear"
        click.prompt(ready, default="", show_default=False, prompt_suffix=" ")
    except click.Abort as error:
        raise KeyboardInterrupt from error
    bar = ProgressBar(description(), BarColumn())  # of one experiment after the other
    with open_hand(hand) as opened, bar:
        task = bar.add_task("opening", total=1.0)
        folder.mkdir(exist_ok=True)
        outcome, done = rerun(
            opened,
            case,
            proposal,
            freed=freed,
            folder=folder,
            progress=lambda part, doing: bar.update(task, completed=part, description=doing),
        )
    # It belongs to this case, and opens none of its own.
    go_on = NextStep(GO_ON, shlex.join(["aero-hil", "diagnose", str(folder.parent), "--hil", hand.target]))
    write_results(replace(done, diagnosis=replace(done.diagnosis, case=None, step=go_on)), folder)
    if done.end.kind is EndKind.INTERRUPTED and done.end.error is not None:
        raise done.end.error
    if outcome in (StepOutcome.GONE, StepOutcome.FREED) and (others := failed(done.findings)):
        # What a step mended at its channel may not be all that is wrong with the hand.
        note = "; ".join(filter(None, (note, f"elsewhere {len(others)} checks fail still, so validate again")))
    return outcome, note


def _runs(case: DiagnosisCase) -> str:
    """Return what runs after a step, and for how long."""
    first = case.experiments or AT_LEAST
    more = f"; all of the first run ({_seconds(case.ran)}) where that passes" if set(case.ran) - set(first) else ""
    return f"{', '.join(first)} ({_seconds(first)}){more}"


def _seconds(names: Iterable[str]) -> str:
    return f"{sum(EXPERIMENTS[name].hand_s for name in names):.0f} s"
