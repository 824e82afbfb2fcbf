"""Tables of docs/internals/electronics.md."""

from __future__ import annotations

from math import tau

import numpy as np

import hil
from aero import AeroHand
from aero.channels import Channel
from figures.results import Rows
from firmware_emulator.bench import Bench
from firmware_emulator.hand import EmulatedHand
from firmware_emulator.links.in_process import InProcessLink
from firmware_emulator.servo.electrical import CurrentLaw
from firmware_emulator.servo.parameters import HLS3606M
from hil.checks.shared.signals import CommandStep
from hil.checks.staircase.rise_time import Response, respond

RECORDED_MA = {5: "30", 10: "30", 20: "36-38", 30: "43", 40: "47.5", 46: "50", 52: "50", 75: "45"}
"""Current of a recorded hand, mA a count of error, by the error in counts."""
MA_PER_UNIT = 6.5
"""Nominal scale of the current register."""
STEPPED = (Channel.THUMB_ABDUCTION, Channel.THUMB_CMC_FLEXION, Channel.THUMB_FLEXOR, Channel.INDEX)
STEP = 0.05
"""Of a channel's window."""
HOMED_WITH = ("0.1.0", "0.2.0")


def current() -> Rows:
    """The static current curve beside the recorded one."""
    errors = list(RECORDED_MA)
    efforts = [error * HLS3606M.duty_per_count * HLS3606M.stall_torque for error in errors]
    here = [
        MA_PER_UNIT * CurrentLaw(HLS3606M).at_rest(effort) / error
        for effort, error in zip(efforts, errors, strict=True)
    ]
    return [
        ("error, counts", *map(str, errors)),
        ("recorded, mA a count", *RECORDED_MA.values()),
        ("here", *(f"{value:.1f}" for value in here)),
    ]


def steps() -> Rows:
    """Steps of 5 % on bare shafts: rise, and the largest overshoot."""
    names = ("abduction", "CMC flexion", "flexor", "finger")
    rows = [["10-90 % rise, ms", *names, "overshoot, % of the step"]]
    for firmware in ("pre", "0.2.0"):
        found = [_step(firmware, channel) for channel in STEPPED]
        overshoot = 100.0 * max(response.overshoot for response in found)
        rises = (f"{1e3 * response.rise:.0f}" for response in found)
        rows.append([f"`{firmware}`", *rises, f"{overshoot:.1f}"])
    return rows


def _step(firmware: str, channel: Channel) -> Response:
    """Step one bare shaft from the middle of its window and watch it every millisecond for half a second."""
    bench = Bench()
    electronics = EmulatedHand(bench, firmware=firmware, side="right", seed=0)
    clock = electronics.clock
    hand = AeroHand(InProcessLink(electronics), clock)
    goal = np.full(len(Channel), 32768)
    hand.command_codes(goal.astype(np.uint16))
    clock.sleep_until(clock.now() + 2.0)
    goal[channel] += round(STEP * 65535)
    start = clock.now()
    hand.command_codes(goal.astype(np.uint16))
    times, angles = [], []
    for k in range(1, 500):
        # The electronics move the shafts every 10 ms only; half a millisecond is between two of their instants.
        now = start + 0.001 * k + 0.0005
        clock.sleep_until(now)
        bench.advance_to(now)
        times.append(now)
        angles.append(bench.angles()[channel])
    step = CommandStep(channel, start, times[-1], 0.0, STEP * tau)
    return respond(step, np.array(times), np.array(angles))


def homing() -> Rows:
    """How long homing takes on the built hand."""
    taken = []
    for firmware in HOMED_WITH:
        with hil.emulate(firmware=firmware) as target:
            start = target.clock.now()
            target.hand.home()
            taken.append(target.clock.now() - start)
    return [
        ("", *HOMED_WITH),
        ("duration on the built hand (`reference`), s", *(f"{seconds:.1f}" for seconds in taken)),
    ]


TABLES = (current, steps, homing)
