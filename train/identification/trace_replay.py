"""Replay of a recorded run into an emulated hand, through every byte of the path, and what it reads there."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from aero import AeroHand
from aero.firmware import DEFAULT_FIRMWARE
from aero.protocol import MAX_CODE
from firmware_emulator.firmware.hands import SHAFT_OF_SERVO, HandSide
from firmware_emulator.links.in_process import InProcessLink
from hil.targets.emulated_hand import build_emulated
from model.units import Unit
from train.identification.trace import Trace, closing_current_sign

SETTLE_S = 0.5
"""How long the first command is held before the clock of the recording starts; a recording starts at rest, s."""

HALF_A_DEGREE = 0.5
"""What a reading in whole degrees leaves out on average, degC."""


@dataclass(frozen=True)
class ReplayedTrace:
    """What the emulated hand read where the recorded hand was read. Arrays as in `Trace`."""

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
    currents: bool = True,
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
        currents: whether currents and temperatures are read too, after each position.
    """
    alike = replace(unit, hand=replace(unit.hand, cable_friction_spread=0.0))
    electronics, _ = build_emulated(alike, firmware=firmware, hand=side, seed=seed)
    for servo, shaft in zip(electronics.servos, SHAFT_OF_SERVO, strict=True):
        read = trace.temperatures[np.isfinite(trace.temperatures[:, shaft]), shaft]
        if len(read):
            servo.heat_to(read[0] + HALF_A_DEGREE)
    clock = electronics.clock
    n, m = len(trace.t_command), len(trace.t_read)
    times = np.concatenate([trace.t_command, trace.t_read])
    # A read at the time of a write comes first: a live policy reads, then commands.
    order = np.lexsort((np.r_[np.ones(n), np.zeros(m)], times))
    counts = np.full(trace.counts.shape, np.nan)
    amperes, degrees = counts.copy(), counts.copy()
    sign = closing_current_sign(side)
    with AeroHand(InProcessLink(electronics), clock) as hand:
        hand.command_codes(trace.codes[0])
        start = clock.now() + SETTLE_S + phase_s - times.min()
        for event in order.tolist():
            clock.sleep_until(start + times[event])
            if event < n:
                hand.command_codes(trace.codes[event])
                continue
            row = event - n
            counts[row] = np.rint(hand.read_codes() * trace.spans_counts / MAX_CODE)
            if currents:
                amperes[row] = hand.read_currents() * sign
                degrees[row] = hand.read_temperatures()
    return ReplayedTrace(counts, amperes, degrees)
