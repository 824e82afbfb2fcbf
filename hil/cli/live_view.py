"""Live readings of a hand that nothing here commands, on the terminal and on a page."""

from collections.abc import Sequence
from contextlib import suppress
from importlib.util import find_spec

import numpy as np
from rich.live import Live
from rich.table import Table

from aero.channels import Channel
from aero.clock import WallClock
from aero.errors import AeroError
from aero.exit_code import Exit
from aero.floats import Floats
from aero.protocol import MAX_CODE
from aero.safety import unwinding
from hil.cli.doctor.ports import holders
from hil.cli.exits import Ended
from hil.dialogue.terminal import console
from hil.dialogue.viewing import viewing
from hil.targets.hand_spec import PortSpec
from hil.targets.opening import open_spec
from hil.targets.target import Target
from hil.view.sources import source_of

PERIOD_S = 0.05
"""Period of the readings, s."""


def show_live(spec: PortSpec) -> None:
    """Show the readings of the hand on a port until Ctrl-C; only readings are requested, and nothing is set.

    The page is shown too if the extra `view` is installed.

    Raises:
        Ended: another program has the port open, and would receive the replies of this one.
        ConnectionError: the port is lost.
    """
    if held := holders(spec.port):
        said = f"{spec.port} is open in {', '.join(held)}; `aero-hil guard {spec.port} --view` shows what it drives"
        raise Ended(said, Exit.NO_HAND)
    screen = console()
    with (
        suppress(KeyboardInterrupt),
        unwinding(),
        viewing(find_spec("viser") is not None, spec, stay=False) as page,
        open_spec(spec) as target,
        Live(console=screen, auto_refresh=False) as live,
    ):
        page.follow(source_of(target))
        clock, values, trouble = WallClock(), np.full((3, len(Channel)), np.nan), ""
        due = clock.now()
        while True:
            try:
                values, trouble = _read(target), ""
            except AeroError as error:
                if isinstance(error, ConnectionError):
                    raise
                trouble = str(error)
            live.update(_table(target, values, trouble), refresh=True)
            due = max(due + PERIOD_S, clock.now())
            clock.sleep_until(due)


def _read(target: Target) -> Floats:
    """Read positions (fraction of the window), currents, A, and temperatures, °C: (3, 7), command order."""
    hand = target.hand
    return np.array([hand.read_codes() / MAX_CODE, hand.read_currents(), hand.read_temperatures()])


def _table(target: Target, values: Floats, trouble: str) -> Table:
    positions, currents, temperatures = values
    shown = Table("Channel", title=target.describe(), title_justify="left", caption_justify="left")
    for head in ("closed", "shaft", "current", "servo"):
        shown.add_column(head, justify="right")
    angles = np.rad2deg(
        np.asarray(target.map.angles_from_codes(np.nan_to_num(positions * MAX_CODE).round().astype(int)))
    )
    for channel in Channel:
        shown.add_row(channel.label, *_cells((
            (100.0 * positions[channel], "{:.0f} %"), (angles[channel], "{:z.1f}°"),
            (currents[channel], "{:z.2f} A"), (temperatures[channel], "{:.0f} °C"),
        ), known=bool(np.isfinite(positions[channel]))))  # fmt: skip
    age_ms = 1e3 * target.hand.reading_age_s
    shown.caption = trouble or f"age {age_ms:.0f} ms, nothing is commanded; the protocol has no voltage. Ctrl-C ends"
    return shown


def _cells(values: Sequence[tuple[float, str]], *, known: bool) -> list[str]:
    return [form.format(value) if known else "-" for value, form in values]
