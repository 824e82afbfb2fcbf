"""`aero-hil guard`: a guard between any program and a hand."""

import signal
import sys
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from threading import Thread
from typing import Any

import click

from aero.actuation import ActuationMap, CommandWindow
from aero.clock import WallClock
from aero.exit_code import STOPPING, Exit
from aero.firmware import FIRMWARE, firmware_of
from aero.relay import PortLine
from aero.safety import Standby, Thresholds
from aero.safety.interrupts import noted
from aero.safety.known_port import KnownPort
from aero.safety.opening import SWITCH_OFF
from aero.safety.port_guard import GuardedKind, PortGuard, PortStop
from aero.serial_transport import SerialTransport
from aero.side import Side
from aero_hil_terminal import Terminal
from hil.cli.exits import Ended, usage_errors
from hil.cli.options import SIDE, VIEW
from hil.cli.output_files import FOLDER, LINK
from hil.dialogue.printing import echo
from hil.recordings.output import emptied
from hil.targets.hand_spec import PHYSICAL, PortSpec, named_port
from hil.targets.typed_lines import TypedLines

WORDS = "`resume` accepts commands again after a stop; `status` says how long this grip can be held"


@click.command()
@click.argument("port")
@click.option("--link", type=LINK, metavar="PATH", help="Create a symbolic link to the pseudo-terminal.")
@click.option("--firmware", type=click.Choice(FIRMWARE), help="Firmware version of the hand; no board reports it.")
@click.option("--side", type=SIDE, help="Side of the hand.")
@click.option("--resume-with-next", is_flag=True, help="Resume after a stop with the next client instead of `resume`.")
@click.option(
    "--black-box", type=FOLDER, default="stops", show_default=True,
    help="Folder for a recording of the last three minutes at each stop.",
)  # fmt: skip
@VIEW
@click.option(
    "--prompt", is_flag=True, help="Accept `resume` and `status` on standard input even if it is not a terminal."
)
def guard(
    *,
    port: str,
    link: Path | None,
    firmware: str | None,
    side: Side | None,
    resume_with_next: bool,
    black_box: Path,
    view: bool,
    prompt: bool,
) -> None:
    """Guard the hand at PORT (device path, pyserial URL or name) for any program on a pseudo-terminal.

    Bytes pass unchanged while the hand is well. A violation of a threshold, and a program that ends, is killed or falls
    silent with the hand closed, opens the hand slowly; commands are then refused until `resume` is typed. A name in
    hands.toml also provides version, side, thresholds and forbidden regions. See "Safety of a
    moving hand" in the documentation.

    Prints one line `ready PATH` once a client can open PATH.
    """
    stopping = [one for one in STOPPING if signal.getsignal(one) is not signal.SIG_IGN]
    with noted(*stopping) as ended, ExitStack() as opened:
        with usage_errors():
            spec = named_port(port, firmware=firmware, side=side)
            if link is not None:
                LINK.distinct(link)
            FOLDER.prepared(black_box)
        opened.enter_context(emptied(black_box))
        limits, usual = spec.thresholds or Thresholds(), firmware_of(spec.firmware).settings
        spans = CommandWindow.for_firmware(spec.firmware, None, spec.side).spans_counts()
        known = KnownPort.of(spec.port)
        with usage_errors():
            terminal = opened.enter_context(Terminal(link))
        typed = TypedLines(reads=prompt or (sys.stdin is not None and sys.stdin.isatty()))
        about = {name: getattr(spec, name) for name in ("firmware", "side", "hand_id")} | {"target": spec.port}
        box = _Stops(black_box, typed, about)

        def connect() -> PortLine:
            transport = SerialTransport.open(known.now())
            while terminal.read():
                pass  # what a client sent meanwhile is too old
            return PortLine(terminal, transport)

        between = PortGuard(
            connect, WallClock(), GuardedKind(spans, usual, limits), name=spec.port, has_client=terminal.has_client,
            stopped=box.stopped, said=_said, resumes_alone=resume_with_next,
        )  # fmt: skip
        between.listeners.append(box.add)
        if view:
            _shown(spec, opened, between)
        try:
            between.open()
        except ConnectionError as error:
            raise Ended(str(error), Exit.NO_HAND) from error
        standby = Standby(spec.port, limits, settable=usual is not None)
        standby.start()
        echo(f"ready {terminal.name}")
        is_open = False
        try:
            is_open = between.run(lambda: bool(ended) or _obeyed(typed, between))
        finally:
            box.close()
            (standby.stand_down if is_open else standby.take_over)()
    if not is_open:
        raise Ended(SWITCH_OFF, Exit.STOPPED)


def _shown(spec: PortSpec, opened: ExitStack, between: PortGuard) -> None:
    """Show the hand on a page: by the readings of the client and of the guard."""
    from hil.dialogue.viewing import viewing  # noqa: PLC0415 - needs the extra `view`
    from hil.targets.wire_log import WireRecord  # noqa: PLC0415 - as above
    from hil.view.sources import WireSource  # noqa: PLC0415 - as above

    clock = WallClock()
    source = WireSource(ActuationMap.for_firmware(spec.firmware, side=spec.side))

    def take(to_hand: bool, data: bytes) -> None:
        source.take(WireRecord(clock.now(), "to_hand" if to_hand else "from_hand", data))

    between.listeners.append(take)
    opened.enter_context(viewing(True, spec, stay=False)).follow(source)


def _said(text: str) -> None:
    echo(text, err=True)


def _obeyed(typed: TypedLines, between: PortGuard) -> bool:
    """Execute typed words; return False, because none ends the guard."""
    try:
        lines = typed.taken()
    except ValueError as error:
        _said(str(error))
        return False
    for line in filter(None, map(str.strip, lines)):
        if line == "resume":
            between.resume()
        else:
            _said(between.status() if line == "status" else WORDS)
    return False


class _Stops:
    """Announcement and black box of the stops."""

    def __init__(self, folder: Path, typed: TypedLines, about: dict[str, Any]) -> None:
        self._typed = typed
        self._writers: list[Thread] = []
        self._box: Any = None
        try:
            from hil.recordings.black_box import BlackBox  # noqa: PLC0415 - needs an extra; a guard does without
        except ModuleNotFoundError as error:
            _said(f"no black box is written, because `{error.name}` is missing; pip install 'aero-hil[hil]'")
        else:
            self._box = BlackBox(folder, WallClock(), unit=PHYSICAL, **about)

    def add(self, to_hand: bool, data: bytes) -> None:
        """Keep bytes of the port."""
        if self._box is not None:
            self._box.add(to_hand, data)

    def stopped(self, stop: PortStop) -> None:
        """Announce a stop, and write the black box in a thread, so that the port goes on."""
        self._typed.drop()
        _said(stop.text)
        if self._box is not None:
            taken = self._box.taken(stop.text)
            self._writers.append(Thread(target=_written, args=(lambda: self._box.write(taken),)))
            self._writers[-1].start()

    def close(self) -> None:
        """Wait for the files."""
        for writer in self._writers:
            writer.join()


def _written(write: Callable[[], Path]) -> None:
    from hil.recordings.errors import CannotBeWrittenError  # noqa: PLC0415

    try:
        _said(f"recorded in {write()}")
    except (OSError, CannotBeWrittenError) as error:
        _said(f"the black box was not written: {error}")
