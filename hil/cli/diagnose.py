"""`aero-hil diagnose`: which part of a hand that failed is at fault, step by step."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from aero.exit_code import Exit
from aero.whole_file import write_whole
from hil.cli.exits import usage_errors
from hil.cli.options import open_hand
from hil.cli.terminal import ProgressBar, console
from hil.report.page import render_case
from hil.report.results import write_results
from hil.targets.hand_spec import HandSpec
from hil.verdict.case import DiagnosisCase, Proposal
from hil.verdict.case_file import read_case, write_case
from hil.verdict.case_words import asked, came_of, conclusion, why
from hil.verdict.rerun import rerun
from hil.verdict.steps import StepOutcome


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
        if hand.target == "emulated":
            raise click.UsageError("a person changes the hand between two runs; give its port with --hil")
    for done in case.done:
        out.print(f"done       {came_of(done)}")
    while (proposal := case.next_step) is not None:
        out.print(f"why        {why(case, proposal)}")
        out.print(f"next step  {asked(proposal)}")
        outcome, note = _taken(hand, case, proposal, folder / f"step-{len(case.done) + 1}")
        if outcome is None:
            out.print("this run says nothing about the hand, as where this computer was busy; the step is asked again")
            continue
        case = case.after(proposal, outcome, note)
        write_case(folder, case, about)
        out.print(f"so         {outcome.value}")
    write_whole(folder / "case.html", render_case(case))
    out.print(conclusion(case), style="bold")
    out.print(str(folder / "case.html"))
    sys.exit(Exit.WITHIN_LIMITS if case.gone else Exit.OUT_OF_LIMITS)


def _taken(hand: HandSpec, case: DiagnosisCase, proposal: Proposal, folder: Path) -> tuple[StepOutcome | None, str]:
    """Let a person do a step, and return what came of it with what the person noted.

    Raises:
        KeyboardInterrupt: at the end of the input, and on Ctrl-C.
    """
    note = ""
    try:
        if proposal.step.asks:
            seen = click.confirm("yes or no")
            note = str(click.prompt("what was measured or read", default="", show_default=False))
            if seen or not proposal.step.runs:
                return StepOutcome.SEEN if seen else StepOutcome.STAYS, note
        click.prompt("press Enter when it is done", default="", show_default=False, prompt_suffix=" ")
    except click.Abort as error:
        raise KeyboardInterrupt from error
    bar = ProgressBar()
    with open_hand(hand) as opened, bar:
        task = bar.add_task("opening", total=1.0)
        folder.mkdir(exist_ok=True)
        outcome, done = rerun(
            opened,
            case,
            proposal,
            folder=folder,
            progress=lambda part, doing: bar.update(task, completed=part, description=doing),
        )
    write_results(done, folder)
    return outcome, note
