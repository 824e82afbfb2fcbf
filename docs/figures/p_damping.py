"""The baseline model: seven independent P-and-damping motors with dry friction and a linear spring, and nothing else.

The best simple model of the recorded hand (public logs June-July 2026, TTdragoAlex/tetherIA-aero-hand-open 58b518e):
11.5 counts rms over all of its other runs, 6.8 without the one at the speed limit. A calibrated unit has to predict
traces better than this one, searched and scored by the same functions.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import click
import numpy as np

from aero.channels import Channel
from aero.protocol import MAX_CODE
from train.identification.replay_score import held_out, held_out_rms
from train.identification.search import Floats, Free, Residuals, pooled_rms, search
from train.identification.trace import Trace, load_trace

STEP_S = 1e-3
AGE_S = 6e-3
"""Mean age of a reading: the 10 ms grid of the telemetry and the way over the bus, s."""
SETTLE_S = 0.3
"""How long the first command is held before the recording starts, s."""
ALL = tuple(Channel)

SHARED = {
    "delay_s": (15.3e-3, 2e-3),
    "duty_per_count": (0.00862, 1e-3),
    "no_load_counts_per_s": (8286.0, 800.0),
    "time_constant_s": (16.3e-3, 3e-3),
    "damping_duty_s_per_count": (1.21e-4, 0.4e-4),
}
"""Start and spread of what all channels share."""
BY_CHANNEL = {
    "friction_counts": ((6.7, 4.8, 6.7, 5.8, 4.8, 8.5, 3.4), 2.0),
    "load_counts": ((9.1, 4.4, 7.9, 6.3, -2.2, 8.9, 3.0), 3.0),
    "load_rise_counts": ((12.4, 21.1, 14.0, 9.3, 0.6, 14.6, 16.5), 6.0),
}
"""Start, (7,) in command order, and spread of what each channel has; counts of servo error."""
FREE = tuple(Free(name, (), ALL, spread) for name, (_, spread) in SHARED.items()) + tuple(
    Free(name, (channel,), (channel,), spread) for name, (_, spread) in BY_CHANNEL.items() for channel in Channel
)
START = np.array([*(start for start, _ in SHARED.values()), *np.ravel([start for start, _ in BY_CHANNEL.values()])])


@dataclass(frozen=True)
class PDampingModel:
    """The motors as a `Model`."""

    traces: tuple[Trace, ...]
    free: tuple[Free, ...] = FREE
    phases_s: tuple[float, ...] = (0.0,)
    """Readings have their mean age; the telemetry grid is not modelled."""

    def residuals(self, x: Sequence[Floats], phases_s: Sequence[float]) -> Residuals:
        """Return predicted less recorded counts, all traces in one integration, one round of them after the other."""
        if len(x) > (n := len(self.traces)):
            return self.residuals(x[:n], phases_s[:n]) + self.residuals(x[n:], phases_s[n:])
        shared, by_channel = np.split(START + np.stack(x), [len(SHARED)], axis=1)
        shared_columns = shared.T[:, :, None]
        friction, load, rise = by_channel.reshape(len(x), len(BY_CHANNEL), len(Channel)).transpose(1, 0, 2)
        angles = self._simulate(shared_columns, friction, load, rise)
        return [
            np.clip(_sample(angles[:, k], trace, phase), 0.0, trace.spans_counts) - trace.counts
            for k, (trace, phase) in enumerate(zip(self.traces, phases_s, strict=True))
        ]

    def _simulate(self, shared: Floats, friction: Floats, load: Floats, rise: Floats) -> Floats:
        """Return angles, (steps, traces, 7) counts, every `STEP_S` from `SETTLE_S` before a trace's first event."""
        delay, gain, no_load, time_constant, damping = shared
        goals = [_goals(trace, late) for trace, late in zip(self.traces, delay[:, 0].tolist(), strict=True)]
        steps = max(map(len, goals))
        goal = np.stack([np.pad(g, ((0, steps - len(g)), (0, 0)), mode="edge") for g in goals], axis=1)
        spans = np.stack([trace.spans_counts for trace in self.traces])
        angle, speed = goal[0].copy(), np.zeros_like(goal[0])
        angles = np.empty_like(goal)
        pull = STEP_S * no_load / time_constant
        for step in range(steps):
            error = goal[step] - angle
            duty = gain * error - damping * speed
            free = np.abs(duty) < 1.0
            # What opposes the speed is implicit in it; friction takes what is left of it at most.
            drag = 1.0 + STEP_S / time_constant + np.where(free, pull * damping, 0.0)
            driven = np.where(free, gain * error, np.clip(duty, -1.0, 1.0)) - gain * (load + rise * angle / spans)
            moved = (speed + pull * driven) / drag
            speed = np.copysign(np.maximum(np.abs(moved) - pull * gain * friction / drag, 0.0), moved)
            angle = angle + STEP_S * speed
            angles[step] = angle
        return angles


def _start(trace: Trace) -> float:
    return float(min(trace.t_command[0], trace.t_read[0])) - SETTLE_S


def _goals(trace: Trace, delay_s: float) -> Floats:
    """Return the goals that the motors act on, (steps, 7) counts."""
    times = np.arange(_start(trace), max(trace.t_command[-1], trace.t_read[-1]) + STEP_S, STEP_S)
    latest = np.maximum(np.searchsorted(trace.t_command + delay_s, times, side="right") - 1, 0)
    goals: Floats = np.rint(trace.codes * trace.spans_counts / MAX_CODE)[latest]
    return goals


def _sample(angles: Floats, trace: Trace, phase_s: float) -> Floats:
    """Return the angles at a trace's readings, between steps by interpolation, (m, 7) counts."""
    at = (trace.t_read - AGE_S + phase_s - _start(trace)) / STEP_S - 1.0
    below = np.clip(np.floor(at).astype(int), 0, len(angles) - 2)
    share = np.clip(at - below, 0.0, 1.0)[:, None]
    sampled: Floats = (1.0 - share) * angles[below] + share * angles[below + 1]
    return sampled


@click.command()
@click.argument("runs", nargs=-1, required=True, type=click.Path(exists=True, dir_okay=False, path_type=Path))
def main(runs: tuple[Path, ...]) -> None:
    """Fit the model to RUNS and print its error, counts rms: fitted to all, and left out."""
    model = PDampingModel(tuple(load_trace(path) for path in runs))
    found = search(model, report=click.echo)
    click.echo(f"{pooled_rms(found.residuals):.2f} fitted to all, {held_out_rms(held_out(model, found)):.2f} left out")


if __name__ == "__main__":
    main()
