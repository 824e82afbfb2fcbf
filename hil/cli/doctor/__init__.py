"""`aero-hil doctor`: look at this machine, its ports and the hand at rest, and say what to do."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

import click

from aero.clock import WallClock
from hil.cli.doctor.hand import check_hand
from hil.cli.doctor.installation import check_installation
from hil.cli.doctor.machine import check_drawing, check_jitter, lateness_s
from hil.cli.doctor.ports import check_ports, holders, list_ports, read_port
from hil.cli.exits import Exit
from hil.robots.finding import Examined, Subject, Verdict, worst


def _ports(named: str) -> Iterator[Examined]:
    ports = list_ports()
    if named and all(port.device != named for port in ports) and Path(named).exists():
        ports += (read_port(named),)
    return check_ports(ports, named)


EXAMINATIONS: tuple[Callable[[], Iterable[Examined]], ...] = (
    check_installation,
    lambda: [check_drawing()],
    lambda: [check_jitter(lateness_s(WallClock()))],
)
"""Examinations of this machine."""
EXAMINATIONS_OF_A_PORT: tuple[Callable[[str], Iterable[Examined]], ...] = (
    _ports,
    lambda named: check_hand(named, holders(named)) if named else (),
)
"""Each takes the port that was named, empty without one."""


def examine(named: str = "") -> Iterator[Examined]:
    """Yield every finding as it is made."""
    for examination in EXAMINATIONS:
        yield from examination()
    for examination_of_a_port in EXAMINATIONS_OF_A_PORT:
        yield from examination_of_a_port(named)


FORMAT = 1
"""Number of the shape that `--json` prints; another one when a name in it changes."""
COLOURS = {Verdict.OK: "green", Verdict.LOOK: "yellow", Verdict.WRONG: "red"}


@click.command()
@click.option("--hil", "port", metavar="PORT", help="Port of a hand, which is asked at rest; nothing moves.")
@click.option("--json", "as_json", is_flag=True, help="Print data for programs and for bug reports.")
def doctor(port: str | None, as_json: bool) -> None:
    """Look at this machine, its serial ports and a hand at rest, and say what to do."""
    if port == "":
        raise click.BadParameter("it is empty; name a port, or leave --hil away", param_hint="--hil")
    findings = []
    for finding in examine(port or ""):
        findings.append(finding)
        if not as_json:
            show(finding)
    if as_json:
        click.echo(json.dumps(_document(findings), indent=2))
    sys.exit(exit_code(findings))


def exit_code(findings: Iterable[Examined]) -> Exit:
    """Return 3 where no hand answers, 1 where something else is wrong, 0 where all works."""
    findings = tuple(findings)
    if worst(findings, Subject.LINK) is Verdict.WRONG:
        return Exit.NO_HAND
    return Exit.OUT_OF_LIMITS if worst(findings) is Verdict.WRONG else Exit.WITHIN_LIMITS


def _document(findings: list[Examined]) -> dict[str, Any]:
    return {"format": FORMAT, "verdict": worst(findings), "findings": [finding.as_dict() for finding in findings]}


def show(finding: Examined) -> None:
    """Print one line of the table, and what to do."""
    colour = None if "NO_COLOR" in os.environ else COLOURS[finding.verdict]
    click.echo(f"{click.style(f'{finding.verdict:5}', fg=colour)} {finding.check}: {finding.finding}")
    if finding.remedy:
        click.echo(f"      -> {finding.remedy}")
    for line in finding.copy:
        click.echo(f"         {line}")
