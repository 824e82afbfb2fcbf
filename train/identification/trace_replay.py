"""Replay of a recorded run into an emulated hand, with the readings of its board.

A calibration needs hundreds of replays, so a reading is taken from the board's memory at the time of its answer instead
of being requested through the link. A test compares the replay with a driver that uses the link.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from aero.driver import CURRENT_A_PER_UNIT
from aero.firmware import DEFAULT_FIRMWARE
from aero.protocol import MAX_CODE, make_positions
from firmware_emulator.firmware.board import Board
from firmware_emulator.firmware.hands import SHAFT_OF_SERVO, Side
from firmware_emulator.kernel import on_grid
from hil.emulated.emulated_hand import build_emulated
from hil.emulated.emulated_spec import EmulatedSpec
from model.units import Unit
from train.identification.trace import Trace, closing_current_sign

SETTLE_S = 0.5
"""Duration of the first command before the start of the recording's clock, s; recordings start at rest."""
READ = ("positions", "currents", "temperatures")
"""Sensor series used by the fit, in this order."""
HALF_A_DEGREE = 0.5
"""Mean error of a temperature truncated to whole degrees, degC."""


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
    side: Side = "right",
    seed: int = 0,
    phase_s: float = 0.0,
    fields: Sequence[str] = READ,
) -> ReplayedTrace:
    """Send a trace's commands at their times and read at its read times; servos start at the recorded temperatures.

    Sheath friction is equal in all closures, because its random variation differs on every hand.

    Args:
        trace: the recorded run.
        unit: the emulated hand.
        firmware: firmware of the recorded hand.
        side: side of the recorded hand.
        seed: seed of the emulated hand's noise.
        phase_s: shift of the recording relative to the board's 10 ms telemetry grid, s; recordings do not contain it.
        fields: series to read in sequence, each with its link delay; the others are NaN.
    """
    alike = replace(unit, hand=replace(unit.hand, cable_friction_spread=0.0))
    electronics, _ = build_emulated(alike, EmulatedSpec(firmware=firmware, side=side, seed=seed))
    for servo, shaft in zip(electronics.servos, SHAFT_OF_SERVO, strict=True):
        read = trace.temperatures[np.isfinite(trace.temperatures[:, shaft]), shaft]
        if len(read):
            servo.heat_to(read[0] + HALF_A_DEGREE)
    clock, board, latency_s = electronics.clock, electronics.board, electronics.host_latency_s
    assert isinstance(board, Board)
    n, m = len(trace.t_command), len(trace.t_read)
    times = np.concatenate([trace.t_command, trace.t_read])
    # A read precedes a write of equal time, as in a policy's control loop.
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
            # Requests are sequential; each is answered on arrival.
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
