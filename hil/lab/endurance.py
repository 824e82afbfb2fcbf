"""Endurance: many full cycles, and how range and current drift over them.

Every cycle is one line in a file, so a run that was interrupted goes on where it stopped, also on another day.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from io import TextIOWrapper
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from aero.channels import Channel
from aero.protocol import MAX_CODE
from aero.regular_file import open_regular
from hil.checks.shared.experiment import SAMPLE_S, Measured
from hil.checks.shared.signals import closing_current
from hil.recordings.recorder import Progress, silent
from hil.targets.target import Target

LONGEST_LINE = 4096
"""Characters of a line of the log; a cycle has some 600."""
HALF_S = 0.9
"""Time to close, and to open again, s."""
ENDS = 0.1
"""Part of the cycles at the beginning and at the end whose medians are compared."""


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
    """Return the cycles that a file holds, none when there is no file.

    Raises:
        ValueError: a line is no cycle; the message names it.
    """
    if not log.exists():
        return []
    cycles, number = [], 0
    try:
        with TextIOWrapper(open_regular(log), encoding="utf-8") as stream:
            while line := stream.readline(LONGEST_LINE):
                number += 1
                cycles.append(_read_cycle(line))
    except (OSError, TypeError, ValueError, RecursionError) as error:
        raise ValueError(f"{log}, line {max(number, 1)}, is no endurance cycle: {error}") from error
    return cycles


def _read_cycle(line: str) -> Cycle:
    cycle = Cycle(**json.loads(line))
    values = [value for row in asdict(cycle).values() for value in row]
    if any(len(row) != len(Channel) for row in asdict(cycle).values()) or not np.isfinite(values).all():
        raise ValueError(f"each list needs {len(Channel)} finite numbers")
    return cycle


def run_endurance(target: Target, cycles: int, log: Path, *, progress: Progress = silent) -> list[Cycle]:
    """Close and open the whole hand until the file holds `cycles` cycles; returns all of them.

    Raises:
        ValueError: the file holds something else.
        SafetyStopError: the guard stopped the hand; the cycles so far are in the file.
    """
    done = read_cycles(log)
    if len(done) < cycles:
        target.begin(stops=Channel)
    while len(done) < cycles:
        cycle = _cycle(target)
        with log.open("a", encoding="utf-8") as stream:
            stream.write(json.dumps(asdict(cycle)) + "\n")
        done.append(cycle)
        progress(len(done) / cycles, f"cycle {len(done)} of {cycles}")
    return done


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
    return {
        channel.label: {
            "range_drift": float(np.median(ranges[-few:, channel]) - np.median(ranges[:few, channel])),
            "current_drift": float(np.median(currents[-few:, channel]) - np.median(currents[:few, channel])),
        }
        for channel in Channel
    }


def _cycle(target: Target) -> Cycle:
    closed, current = _half(target, MAX_CODE)
    opened, _ = _half(target, 0)
    return Cycle(closed, opened, current, target.hand.read_temperatures().tolist())


def _half(target: Target, code: int) -> tuple[list[float], list[float]]:
    """Command all channels for half a cycle; return where they are then, and what they draw."""
    codes: NDArray[np.uint16] = np.full(len(Channel), code, np.uint16)
    start = target.clock.now()
    for i in range(round(HALF_S / SAMPLE_S)):
        target.clock.sleep_until(start + i * SAMPLE_S)
        target.hand.command_codes(codes)
    reached = target.hand.read_codes().astype(float) * 100.0 / MAX_CODE
    return reached.tolist(), closing_current(target.hand.read_currents(), target.side).tolist()
