"""`aero-hil diagnose`: step-by-step isolation of the faulty part of a hand."""

import shlex
import sys
from collections.abc import Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import click

from aero.clock import Clock, WallClock
from aero.exit_code import Exit
from hil.cli.exits import usage_errors
from hil.cli.options import VIEW, open_hand
from hil.dialogue.case_hand import CaseHand, CaseHelper
from hil.dialogue.case_session import CaseSession
from hil.dialogue.page_asker import PageAsker
from hil.dialogue.terminal import console
from hil.dialogue.terminal_asker import TerminalAsker
from hil.dialogue.viewing import asking
from hil.emulated.emulated_case import hand_after
from hil.targets.hand_spec import PortSpec
from hil.targets.hands_file import EMULATED_TARGETS, fields_at
from hil.targets.opening import serial_number
from hil.targets.target import Target
from hil.verdict.case_file import HandOfCase, read_case


@dataclass(frozen=True)
class HandOnPort:
    """Hand on a port."""

    spec: PortSpec
    clock: Clock = field(default_factory=WallClock)
    helper: CaseHelper | None = None

    def open(self, *, may_be_silent: bool = False) -> AbstractContextManager[Target]:
        """Open the hand."""
        return open_hand(self.spec, may_be_silent=may_be_silent)


FILE = click.Path(exists=True, dir_okay=False, path_type=Path)
BASELINE = click.Path(exists=True, file_okay=False, path_type=Path)


@click.command()
@click.argument(
    "folder", metavar="[CASE]", type=click.Path(exists=True, file_okay=False, path_type=Path),
    default="validation/latest",
)  # fmt: skip
@click.option("--hil", "port", metavar="TARGET", help="Port of the hand, or its name in hands.toml.")
@VIEW
@click.option("--unit", type=FILE, help="Unit file of the emulated hand of the case.")
@click.option("--firmware-program", "program", type=FILE, help="Firmware program of the emulated hand of the case.")
@click.option("--baseline", type=BASELINE, help="Baseline with which the run of the case was compared.")
@click.option("--same-hand", is_flag=True, help="Accept another name or serial number for the hand of the case.")
def diagnose(
    *,
    folder: Path,
    port: str | None,
    view: bool,
    unit: Path | None,
    program: Path | None,
    baseline: Path | None,
    same_hand: bool,
) -> None:
    """Isolate the faulty part of a hand step by step, with a rerun of the failed experiments after each step.

    CASE is the folder of the failed run (default: validation/latest), which also provides firmware version and side.
    Without --hil, the emulated hand of the case is recreated with its faults, and the program can do each step. No file
    is opened because a case names it; the command that a failed run prints names the files of its hand. Ctrl-C
    interrupts the case; the same command resumes it. Exit code 0: the failure is gone and its cause known; else 1.
    """
    with usage_errors():
        stored = read_case(folder)
        given = {"--unit": unit, "--firmware-program": program, "--baseline": baseline}
        known = _with_files(stored.hand, {option: str(path.absolute()) for option, path in given.items() if path})
        if port is not None:
            hand: CaseHand = _on_port(known, port, same_hand=same_hand)
        else:
            hand = hand_after(stored.case, known)
    asker = PageAsker(console()) if view else TerminalAsker(console())
    try:
        with asking(asker, hand.spec):
            session = CaseSession(stored, folder, hand, asker)
            session.go_through()
    except BaseException as error:
        asker.close()
        if isinstance(error, KeyboardInterrupt):
            asker.tell("the case is interrupted; the same command resumes it at this step")
        raise
    sys.exit(Exit.WITHIN_LIMITS if session.case.mended else Exit.OUT_OF_LIMITS)


def _with_files(hand: HandOfCase, given: Mapping[str, str]) -> HandOfCase:
    """Return the hand of a case with its files as the command line names them.

    Raises:
        ValueError: a file that the case does not have, or does not get.
    """
    if strange := sorted(given.keys() - hand.options.keys()):
        raise ValueError(f"the hand of this case has no {', '.join(strange)}")
    if missing := {option: path for option, path in hand.options.items() if option not in given}:
        words = shlex.join(word for pair in missing.items() for word in pair)
        raise ValueError(f"no file is opened because a case names it; add {words}")
    fields: dict[str, Any] = {option.removeprefix("--").replace("-", "_"): path for option, path in given.items()}
    return replace(hand, **fields)


def _on_port(known: HandOfCase, port: str, *, same_hand: bool) -> CaseHand:
    """Return the hand on a port after checking that it is the case's."""
    said = fields_at(port, known.hand_id)
    if said["port"] in EMULATED_TARGETS:
        raise click.UsageError("a port or a name is given with --hil; leave it out for the emulated hand of the case")
    if not same_hand:
        serial = serial_number(said["port"])
        known.require_same({"hand_id": serial, "serial_number": serial, **said})
    spec = PortSpec(**{**said, "firmware": known.firmware, "side": known.side})
    return HandOnPort(replace(spec, baseline=Path(known.baseline)) if known.baseline else spec)
