"""`aero-hil doctor`: examination of this machine, its ports and a hand at rest, with remedies."""

import json
import os
import sys
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import click

from aero.exit_code import Exit
from aero.printable import printable
from hil.cli.doctor.finding import Examined, Subject, Verdict, worst
from hil.cli.doctor.machine import check_drawing, check_installation, check_jitter, lateness_s
from hil.cli.doctor.ports import examine_port
from hil.cli.exits import usage_errors
from hil.dialogue.printing import echo
from hil.targets.hands_file import FILE, add_hand, fields_of, refuse_taken


def examine(named: str = "") -> Iterator[Examined]:
    """Yield every finding at once; `named` is a hand's port, or ""."""
    yield from check_installation()
    yield check_drawing()
    yield check_jitter(lateness_s())
    yield from examine_port(named)


FORMAT = 1
"""Format version of `--json`, increased when a name changes."""
COLOURS = {Verdict.OK: "green", Verdict.LOOK: "yellow", Verdict.WRONG: "red"}


@click.command()
@click.option(
    "--hil", "port", metavar="PORT", help="Port of a hand, or its name in hands.toml; the hand is queried, not moved."
)
@click.option("--save", metavar="NAME", help="Add the hand of --hil under this name to hands.toml in this folder.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON, for programs and bug reports.")
def doctor(port: str | None, save: str | None, as_json: bool) -> None:
    """Examine this machine, its serial ports and a hand at rest, and print remedies."""
    if port == "":
        raise click.BadParameter("the value is empty; give a port, or omit --hil", param_hint="--hil")
    if save is not None and port is None:
        raise click.UsageError("--save needs --hil, because the hand is queried first")
    with usage_errors():
        port = fields_of(port)["port"] if port else ""
        if save is not None:
            refuse_taken(save)
    findings = []
    for finding in examine(port):
        findings.append(finding)
        if not as_json:
            show(finding)
    if as_json:
        document: dict[str, Any] = {"format": FORMAT, "verdict": worst(findings)}
        echo(json.dumps(document | {"findings": [finding.as_dict() for finding in findings]}, indent=2))
    if save is not None:
        echo(_saved(save, port, {finding.check: finding for finding in findings}), err=as_json)
    sys.exit(exit_code(findings))


def _saved(name: str, port: str, findings: Mapping[str, Examined]) -> str:
    """Add a hand that answered to `hands.toml`; return the message."""
    if "firmware" not in findings:
        return f"not saved as {name}: no hand answered"
    add_hand(name, port, findings["firmware"].data["versions"])
    return f"saved in {FILE}: from now on `--hil {name}`"


def exit_code(findings: Iterable[Examined]) -> Exit:
    """Return 3 without an answering hand, 1 for another error, 0 otherwise."""
    findings = tuple(findings)
    if worst(findings, Subject.LINK) is Verdict.WRONG:
        return Exit.NO_HAND
    return Exit.OUT_OF_LIMITS if worst(findings) is Verdict.WRONG else Exit.WITHIN_LIMITS


def show(finding: Examined) -> None:
    """Print one line of the table, with its remedy."""
    colour = None if "NO_COLOR" in os.environ else COLOURS[finding.verdict]
    said = printable(f"{finding.check}: {finding.finding}")
    click.echo(f"{click.style(f'{finding.verdict:5}', fg=colour)} {said}")
    if finding.remedy:
        echo(f"      -> {finding.remedy}")
    for line in finding.copy:
        echo(f"         {line}")
