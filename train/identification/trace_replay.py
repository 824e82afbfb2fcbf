"""Replay of a recorded run into an emulated hand, and what its board answers there.

A calibration is hundreds of replays, so that nothing is sent for a reading: it is taken from the board's memory when
the board would answer. A test holds the replay to what a driver gets through every byte.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from aero.driver import CURRENT_A_PER_UNIT
from aero.firmware import DEFAULT_FIRMWARE
from aero.protocol import MAX_CODE, make_positions
from firmware_emulator.firmware.board import Board
from firmware_emulator.firmware.hands import SHAFT_OF_SERVO, HandSide
from firmware_emulator.kernel import on_grid
from hil.targets.emulated_hand import build_emulated
from hil.targets.hand_spec import HandSpec
from model.units import Unit
from train.identification.trace import Trace, closing_current_sign

SETTLE_S = 0.5
"""How long the first command is held before the clock of the recording starts; a recording starts at rest, s."""
READ = ("positions", "currents", "temperatures")
"""Sensor series used by the fit, in this order."""
HALF_A_DEGREE = 0.5
"""What a reading in whole degrees leaves out on average, degC."""


@dataclass(frozen=True)
class ReplayedTrace:
    """Readings of the emulated hand at the recorded times; arrays as in `Trace`."""

    counts: NDArray[np.float64]
    """(m, 7) servo counts."""
    currents: NDArray[np.float64]
    """(m, 7) A, positive while a channel pulls closed."""
    temperatures: NDArray[np.float64]
    """(m, 7) degC."""


def replay(
    trace: Trace,
    unit: Unit,
    *,
    firmware: str = DEFAULT_FIRMWARE,
    side: HandSide = "right",
    seed: int = 0,
    phase_s: float = 0.0,
    fields: Sequence[str] = READ,
) -> ReplayedTrace:
    """Send a trace's commands at their times and read at its read times; servos start as warm as the recorded ones.

    The sheaths rub alike in all closures: how those of the unit differ is chance, which no other hand shares.

    Args:
        trace: the recorded run.
        unit: the emulated hand.
        firmware: version the recorded hand ran.
        side: which hand it was.
        seed: of the emulated hand's noise.
        phase_s: shifts the recording against the board's telemetry, whose 10 ms grid no recording tells, s.
        fields: what is read, one after the other; a replay waits for each answer. The rest is NaN.
    """
    alike = replace(unit, hand=replace(unit.hand, cable_friction_spread=0.0))
    electronics, _ = build_emulated(alike, HandSpec(firmware=firmware, side=side, seed=seed))
    for servo, shaft in zip(electronics.servos, SHAFT_OF_SERVO, strict=True):
        read = trace.temperatures[np.isfinite(trace.temperatures[:, shaft]), shaft]
        if len(read):
            servo.heat_to(read[0] + HALF_A_DEGREE)
    clock, board, latency_s = electronics.clock, electronics.board, electronics.host_latency_s
    assert isinstance(board, Board)
    n, m = len(trace.t_command), len(trace.t_read)
    times = np.concatenate([trace.t_command, trace.t_read])
    # A read at the time of a write comes first: a live policy reads, then commands.
    order = np.lexsort((np.r_[np.ones(n), np.zeros(m)], times))
    frames = [make_positions(codes) for codes in trace.codes]
    answers: dict[str, list[Sequence[int]]] = {field: [] for field in fields}
    electronics.receive(frames[0])
    start = clock.now() + SETTLE_S + phase_s - times.min()
    for event, t in zip(order.tolist(), (start + times[order]).tolist(), strict=True):
        clock.sleep_until(t)
        if event < n:
            electronics.receive(frames[event])
            continue
        for field in fields:
            # One question after the other, each answered at once when it has arrived.
            clock.sleep_until(on_grid(clock.now() + latency_s))
            answers[field].append(getattr(board.telemetry, field))
    words = {field: np.full(trace.counts.shape, np.nan) for field in READ}
    for field, rows in answers.items():
        words[field][:, list(SHAFT_OF_SERVO)] = rows
    return ReplayedTrace(
        np.rint(words["positions"] * trace.spans_counts / MAX_CODE),
        words["currents"] * CURRENT_A_PER_UNIT * closing_current_sign(side),
        words["temperatures"],
    )
