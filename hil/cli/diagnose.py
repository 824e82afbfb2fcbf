"""`aero-hil diagnose`: step-by-step isolation of the faulty part of a hand."""

import sys
from contextlib import AbstractContextManager
from dataclasses import dataclass, field, replace
from pathlib import Path

import click

from aero.clock import Clock, WallClock
from aero.exit_code import Exit
from hil.cli.exits import usage_errors
from hil.cli.options import VIEW, open_hand
from hil.dialogue.case_hand import CaseHand, CaseHelper
from hil.dialogue.case_session import CaseSession
from hil.dialogue.page_asker import PageAsker, SeenHand, asking
from hil.dialogue.printing import echo
from hil.dialogue.terminal import console
from hil.dialogue.terminal_asker import TerminalAsker
from hil.emulated.emulated_case import EmulatedCaseHand, emulated_hand
from hil.emulated.emulated_spec import named_spec
from hil.emulated.standing_hand import StandingHand
from hil.report.run_folder import CASE_PAGE
from hil.targets.hand_spec import PHYSICAL, PortSpec
from hil.targets.hands_file import fields_of
from hil.targets.opening import serial_number
from hil.targets.target import Target
from hil.verdict.case_file import HandOfCase, StoredCase, read_case


@dataclass(frozen=True)
class HandOnPort:
    """Hand on a port."""

    spec: PortSpec
    clock: Clock = field(default_factory=WallClock)
    helper: CaseHelper | None = None

    def open(self, *, may_be_silent: bool = False) -> AbstractContextManager[Target]:
        """Open the hand."""
        return open_hand(self.spec, may_be_silent=may_be_silent)


@click.command()
@click.argument(
    "folder", metavar="[CASE]", type=click.Path(exists=True, file_okay=False, path_type=Path),
    default="validation/latest",
)  # fmt: skip
@click.option("--hil", "port", metavar="TARGET", help="Port of the hand, or its name in hands.toml.")
@VIEW
@click.option("--same-hand", is_flag=True, help="Accept another name or serial number for the hand of the case.")
def diagnose(*, folder: Path, port: str | None, view: bool, same_hand: bool) -> None:
    """Isolate the faulty part of a hand step by step, with a rerun of the failed experiments after each step.

    CASE is the folder of the failed run (default: validation/latest), which also provides firmware version and side.
    Without --hil, the emulated hand of the case is recreated with its faults, and the program can do each step. Ctrl-C
    interrupts the case; the same command resumes it. Exits with 0 if the failure is gone and its cause known, else 1.
    """
    with usage_errors():
        stored = read_case(folder)
        hand = _emulated(stored) if port is None else _on_port(stored.hand, port, same_hand=same_hand)
    asker = PageAsker(console()) if view else TerminalAsker(console())
    try:
        with asking(asker, hand.spec) as page:
            session = CaseSession(stored, folder, SeenHand(hand, page), asker)
            session.go_through()
    except BaseException as error:
        asker.close()
        if isinstance(error, KeyboardInterrupt):
            asker.tell("the case is interrupted; the same command resumes it at this step")
        raise
    echo(folder / CASE_PAGE)
    sys.exit(Exit.WITHIN_LIMITS if session.case.mended else Exit.OUT_OF_LIMITS)


def _emulated(stored: StoredCase) -> CaseHand:
    """Return the emulated hand of a case in its state after the last step."""
    if stored.hand.unit == PHYSICAL:
        raise click.UsageError("the case is of a hand on a port; give it with --hil")
    hand = EmulatedCaseHand(StandingHand(emulated_hand(stored.hand)))
    hand.redo(stored.case)
    return hand


def _on_port(known: HandOfCase, port: str, *, same_hand: bool) -> CaseHand:
    """Return the hand on a port after checking that it is the case's."""
    hand = named_spec(port)
    if hand.in_software:
        raise click.UsageError("a port or a name is given with --hil; leave it out for the emulated hand of the case")
    if not same_hand:
        serial = serial_number(hand.port)
        known.require_same({"hand_id": hand.hand_id or serial, "serial_number": serial, **fields_of(port)})
    return HandOnPort(replace(hand, firmware=known.firmware, side="left" if known.side == "left" else "right"))
