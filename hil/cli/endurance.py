"""`aero-hil endurance`: many full cycles, and how range and current drift over them.

Every cycle is one line of a file, so an interrupted run resumes where it stopped, also on another day.
"""

from __future__ import annotations

import json
import os
from dataclasses import asdict, dataclass
from pathlib import Path

import click
import numpy as np

from aero.channels import Channel
from aero.protocol import MAX_CODE
from aero.regular_file import open_regular
from hil.checks.shared.experiment import SAMPLE_S, Measured
from hil.checks.shared.signals import closing_current
from hil.cli.exits import usage_errors
from hil.cli.options import ChosenHand, target
from hil.cli.terminal import ProgressBar
from hil.recordings.output import prepared_file
from hil.recordings.recorder import Progress, silent
from hil.targets.target import Target

MOST_BYTES = 2**30
"""Largest log, of a million cycles."""
FIRST_KEY = b'{"closed_percent"'
HALF_S = 0.9
"""Time to close, and to open again, s."""
ENDS = 0.1
"""Fraction of the cycles at the beginning and at the end whose medians are compared."""


@dataclass(frozen=True)
class Cycle:
    """What one cycle reached; lists of seven in command order."""

    closed_percent: list[float]
    """Encoder at the end of the closing half, % of the window."""
    open_percent: list[float]
    """Encoder at the end of the opening half."""
    closing_current: list[float]
    """Current at the end of the closing half, A, positive closes."""
    temperature: list[float]
    """degC at the end of the cycle."""


def read_cycles(log: Path) -> list[Cycle]:
    """Return the cycles of a file, none when there is no file; a last line that was cut is passed over.

    Raises:
        OSError: the file cannot be read.
        ValueError: a line is not a cycle; the message names it.
    """
    if not log.exists():
        return []
    try:
        with open_regular(log, MOST_BYTES) as stream:
            *lines, last = stream.read().split(b"\n")
    except OSError as error:
        raise OSError(f"{log} cannot be read: {error}") from error
    if last[: len(FIRST_KEY)] != FIRST_KEY[: len(last)]:
        lines.append(last)
    cycles = []
    for number, line in enumerate(lines, 1):
        try:
            cycle = Cycle(**json.loads(line))
            values = np.array(list(asdict(cycle).values()), float)
            if values.shape != (4, len(Channel)) or not np.isfinite(values).all():
                raise ValueError(f"each list needs {len(Channel)} finite numbers")
        except (TypeError, ValueError, RecursionError) as error:
            raise ValueError(f"{log}, line {number}, is not an endurance cycle: {error}") from error
        cycles.append(cycle)
    return cycles


def run_endurance(target: Target, cycles: int, log: Path, *, progress: Progress = silent) -> None:
    """Close and open the whole hand until the file holds `cycles` cycles.

    Raises:
        ValueError: the file holds something else.
        SafetyStopError: the guard stopped the hand; the cycles so far are in the file.
    """
    done = len(read_cycles(log))
    if log.exists() and not (text := log.read_bytes()).endswith(b"\n"):
        os.truncate(log, text.rfind(b"\n") + 1)
    if done < cycles:
        target.begin(stops=Channel)
    for number in range(done + 1, cycles + 1):
        closed, current = _half(target, MAX_CODE)
        opened, _ = _half(target, 0)
        cycle = Cycle(closed, opened, current, target.hand.read_temperatures().tolist())
        with log.open("a", encoding="utf-8") as stream:
            stream.write(json.dumps(asdict(cycle)) + "\n")
        progress(number / cycles, f"cycle {number} of {cycles}")


def _half(target: Target, code: int) -> tuple[list[float], list[float]]:
    """Command all channels for half a cycle; return the positions reached, %, and the closing currents, A."""
    start = target.clock.now()
    for i in range(round(HALF_S / SAMPLE_S)):
        target.clock.sleep_until(start + i * SAMPLE_S)
        target.hand.command_codes(np.full(len(Channel), code, np.uint16))
    reached = target.hand.read_codes().astype(float) * 100.0 / MAX_CODE
    return reached.tolist(), closing_current(target.hand.read_currents(), target.side).tolist()


def drift(cycles: list[Cycle]) -> Measured:
    """Return by how much range (% of the window) and closing current (A) changed from the first to the last cycles.

    Raises:
        ValueError: fewer than two cycles.
    """
    if len(cycles) < 2:
        raise ValueError(f"a drift needs two cycles, there are {len(cycles)}")
    few = max(1, round(ENDS * len(cycles)))
    ranges = np.array([np.subtract(cycle.closed_percent, cycle.open_percent) for cycle in cycles])
    currents = np.array([cycle.closing_current for cycle in cycles])
    ranges, currents = (np.median(of[-few:], axis=0) - np.median(of[:few], axis=0) for of in (ranges, currents))
    return {c.label: {"range_drift": float(ranges[c]), "current_drift": float(currents[c])} for c in Channel}


@click.command()
@target
@click.option(
    "--cycles", type=click.IntRange(2, 1_000_000), required=True, help="Cycles the log shall hold in the end."
)
@click.option(
    "--log", type=click.Path(dir_okay=False, path_type=Path), default=Path("endurance.jsonl"), show_default=True,
    help="One line a cycle; an existing log is continued.",
)  # fmt: skip
def endurance(*, hand: ChosenHand, cycles: int, log: Path) -> None:
    """Open and close the whole hand many times and report what drifts.

    After any ending, Ctrl-C included, the summary is of the cycles that the log holds.
    """
    with usage_errors():
        prepared_file(log)
        read_cycles(log)
    try:
        with hand.open() as opened, ProgressBar() as bar:
            task = bar.add_task("endurance", total=1.0)
            run_endurance(
                opened, cycles, log, progress=lambda part, doing: bar.update(task, completed=part, description=doing)
            )
    finally:
        done = read_cycles(log)
        click.echo(f"{len(done)} cycles in {log}")
        for subject, row in drift(done).items() if len(done) > 1 else ():
            drifts = f"range {row['range_drift']:+.2f} % of the window, current {row['current_drift']:+.2f} A"
            click.echo(f"{subject}: {drifts}")
