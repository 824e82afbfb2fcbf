"""Endurance: many full cycles, and how range and current drift over them.

Every cycle is one line of a file, so an interrupted run resumes where it stopped, also on another day.
"""

from __future__ import annotations

import json
import os
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from aero.channels import Channel
from aero.protocol import MAX_CODE
from aero.regular_file import open_regular
from hil.checks.shared.experiment import SAMPLE_S, Measured
from hil.checks.shared.signals import closing_current
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
    while done < cycles:
        closed, current = _half(target, MAX_CODE)
        opened, _ = _half(target, 0)
        cycle = Cycle(closed, opened, current, target.hand.read_temperatures().tolist())
        with log.open("a", encoding="utf-8") as stream:
            stream.write(json.dumps(asdict(cycle)) + "\n")
        done += 1
        progress(done / cycles, f"cycle {done} of {cycles}")


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
    range_drift, current_drift = (
        np.median(values[-few:], axis=0) - np.median(values[:few], axis=0) for values in (ranges, currents)
    )
    return {
        channel.label: {"range_drift": float(range_drift[channel]), "current_drift": float(current_drift[channel])}
        for channel in Channel
    }


def _half(target: Target, code: int) -> tuple[list[float], list[float]]:
    """Command all channels for half a cycle; return the positions reached, %, and the closing currents, A."""
    start = target.clock.now()
    for i in range(round(HALF_S / SAMPLE_S)):
        target.clock.sleep_until(start + i * SAMPLE_S)
        target.hand.command_codes(np.full(len(Channel), code, np.uint16))
    reached = target.hand.read_codes().astype(float) * 100.0 / MAX_CODE
    return reached.tolist(), closing_current(target.hand.read_currents(), target.side).tolist()
