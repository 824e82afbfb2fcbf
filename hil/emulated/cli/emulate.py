"""`aero-hil emulate`: emulated hand on a pseudo-terminal, in real time."""

from __future__ import annotations

import logging
import signal
import sys
from contextlib import ExitStack, closing
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import click

from aero.actuation import ActuationMap
from aero.safety.interrupts import noted
from firmware_emulator.links.in_process import WireEntry
from hil.cli.exits import usage_errors
from hil.cli.options import FAULT_HELP, FIRMWARE_PROGRAM, RECORD, VIEW, HostAndPort, emulation, link_recorded
from hil.cli.output_files import LINK, RECORDED, STATE
from hil.dialogue.printing import echo
from hil.dialogue.viewing import viewing
from hil.emulated.control import ControlSocket
from hil.emulated.emulated_spec import EmulatedSpec, parsed_faults
from hil.emulated.hand_source import EmulatedSource
from hil.emulated.hands_on import OFFERED, HandsOn
from hil.emulated.served_hand import ServedHand
from hil.targets.delays import LEAST_S, DelayLog, Loop
from hil.view.feed import Observer

if TYPE_CHECKING:
    from hil.recordings.wire_file import WireFile

_LOG = logging.getLogger(__name__)


@click.command()
@emulation
@FIRMWARE_PROGRAM
@click.option("--link", type=LINK, metavar="PATH", help="Create a symbolic link to the pseudo-terminal.")
@click.option(
    "--bus-link", type=LINK, metavar="PATH", help="Also serve the raw servo bus, on a pseudo-terminal linked at PATH."
)
@click.option(
    "--bus-port",
    metavar="PORT",
    help="Serve the servos on this serial port, for a physical board; no board is emulated.",
)
@click.option("--listen", type=HostAndPort(), help="Also serve the board at rfc2217://HOST:PORT, with DTR and RTS.")
@click.option("--state", type=STATE, help="Keep the board's stored calibration in this file.")
@click.option("--fault", "faults", multiple=True, metavar="FAULT", help=FAULT_HELP)
@click.option(
    "--control",
    type=LINK,
    metavar="PATH",
    help="Create a socket for acts: one line in, one line out, as at the prompt.",
)
@RECORD
@VIEW
@click.option("--prompt", is_flag=True, help="Accept acts on standard input even if it is not a terminal.")
def emulate(
    *,
    spec: EmulatedSpec,
    link: Path | None,
    bus_link: Path | None,
    bus_port: str | None,
    listen: tuple[str, int] | None,
    state: Path | None,
    control: Path | None,
    faults: tuple[str, ...],
    record: Path | None,
    view: bool,
    prompt: bool,
) -> None:
    """Serve an emulated hand until it is interrupted.

    Prints one line `ready PATH` once a client can open PATH. The terminal then accepts acts on the hand:
    `inject motor_dead:ring`, `clear motor_dead:ring`, `exchange_servos ring pinky`; `help` lists all acts.
    """
    with noted(signal.SIGINT, signal.SIGTERM) as stopped, ExitStack() as opened:
        with usage_errors():
            spec = replace(spec, port="pty", faults=parsed_faults(faults))
            for output, path in ((LINK, link), (LINK, bus_link), (LINK, control), (STATE, state)):
                if path is not None:
                    output.distinct(path)
            if record is not None:
                RECORDED.prepared(record)
            served = ServedHand(spec, state=state, link=link, bus_link=bus_link, bus_port=bus_port, listen=listen)
        electronics, server = served.electronics, served.server

        def tell(text: str, severity: Literal["info", "error"]) -> None:
            echo(text, err=True)
            observer.note(text, severity)
            if file is not None:
                file.note(text, severity)

        hands_on = HandsOn(served.workbench, tell, reads=prompt or in_terminal())
        server.listeners.append(hands_on.heard)

        controlled: ControlSocket | None = None
        if control is not None:
            with usage_errors():
                controlled = opened.enter_context(closing(ControlSocket(control, hands_on.answered)))

        def stop() -> bool:
            hands_on.serve()
            if controlled is not None:
                controlled.serve()
            return bool(stopped)

        delays = DelayLog()
        page = viewing(view, spec, stay=False, on_words=hands_on.put, faults=OFFERED)
        recorded = link_recorded(
            record, target=server.name, unit=served.unit.name, firmware=spec.firmware, side=spec.side, seed=spec.seed,
            delays=delays,
        )  # fmt: skip
        with recorded as file, server, closing(electronics), page as observer:
            server.on_late = partial(_late, delays, observer)
            if file is not None:
                server.listeners.append(partial(_record, file))
            codec = ActuationMap.for_firmware(spec.firmware, side=spec.side)
            observer.follow(EmulatedSource(electronics, served.workbench.mechanics, codec))
            if server.url is not None:
                echo(f"also {server.url}")
            echo(f"ready {server.name}")
            server.run(stop)
    served.workbench.schedule.require_all_fired()


def in_terminal() -> bool:
    """Return whether the standard input is a terminal; it is None if closed at the start."""
    return sys.stdin is not None and sys.stdin.isatty()


def _record(file: WireFile, entry: WireEntry) -> None:
    file.add("to_hand" if entry[1] == ">" else "from_hand", entry[2])


def _late(delays: DelayLog, observer: Observer, late_s: float) -> None:
    """Record a scheduling delay of the board."""
    delays.add(late_s, Loop.BOARD)
    if late_s >= LEAST_S:
        observer.give_way()
        _LOG.info("this computer delayed the emulated board by %.0f ms", 1e3 * late_s)
