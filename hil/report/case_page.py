"""The page of a case: what is at fault, and the chain of steps that says so."""

from __future__ import annotations

from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined

from aero.whole_file import write_whole
from hil.verdict.case import DiagnosisCase
from hil.verdict.case_words import asked, came_of, conclusion, why


def render_case(case: DiagnosisCase) -> str:
    """Return the page of a case; it loads nothing from anywhere."""
    environment = Environment(loader=PackageLoader("hil.report"), autoescape=True, undefined=StrictUndefined)
    steps = [
        (came_of(one), f"step-{number}/report.html", one.proposal.step.asks) for number, one in enumerate(case.done, 1)
    ]
    proposal = case.next_step
    return environment.get_template("case.html.j2").render(
        convicted=case.convicted,
        conclusion=conclusion(case),
        suspects=[(str(suspect), weight) for suspect, weight in case.likely.items()],
        before=[(str(suspect), weight) for suspect, weight in case.suspects.items()],
        steps=steps,
        next="" if proposal is None else f"{asked(proposal)} {why(case, proposal)}",
    )


def write_case_page(folder: Path, case: DiagnosisCase) -> None:
    """Write the page of a case into its folder.

    Raises:
        OSError: the folder cannot be written.
    """
    write_whole(folder / "case.html", render_case(case))
