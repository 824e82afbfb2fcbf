"""Numbers from a staircase recording, as the paper's dynamic validation defines them.

Everything here is a pure function of the recording's series: `command` and `hand` (simulator length of each channel,
m or rad), `model` (the same from the simulator, on its own time base) and `travel` (cable the spools have wound in,
m or rad).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aero.channels import Channel
from hil.checks.shared.experiment import require
from hil.checks.shared.signals import CommandStep, at_times, display_unit, find_steps, rms
from hil.checks.staircase.rise_time import Response, median_rise, respond
from hil.recordings.errors import CannotBeMeasuredError
from hil.recordings.recording import Recording

Floats = NDArray[np.float64]


Mask = NDArray[np.bool_]

QUIET_COMMAND_S = 0.4
"""A sample is settled when no command has changed for this long ..."""
QUIET_TRACE_S = 0.1
"""... and over this long ..."""
QUIET_TRACE_FRACTION = 0.005
"""... neither trace has moved by more than this part of its range; paper, section "Dynamic validation"."""

_TICK = 1e-6
"""Slack of time comparisons, s: far below a sample, far above rounding."""


def residuals(recording: Recording) -> tuple[Floats, Mask]:
    """Return hand less simulator at the hand's sample times, (n, 7) m or rad, and which samples are settled, (n, 7)."""
    command, hand = recording["command"], recording["hand"]
    model = at_times(recording["model"].times, recording["model"].values, hand.times)
    ranges = np.ptp(command.values, axis=0)
    quiet = quiet_command(command.times, command.values, hand.times)[:, None]
    still = quiet_trace(hand.times, hand.values, ranges) & quiet_trace(hand.times, model, ranges)
    return hand.values - model, quiet & still


def quiet_command(times: Floats, command: Floats, at: Floats) -> Mask:
    """Return at which of the times `at` (m,) no command had changed for `QUIET_COMMAND_S`.

    Args:
        times: (n,) float, s, of the commands.
        command: (n, 7) float; the first row counts as a change.
        at: (m,) float, s.
    """
    changed = np.append(True, np.any(np.diff(command, axis=0) != 0, axis=1))
    last = np.searchsorted(times[changed], at + _TICK, side="right") - 1
    since = np.where(last >= 0, at - times[changed][np.maximum(last, 0)], 0.0)
    return np.asarray(since >= QUIET_COMMAND_S - _TICK)


def quiet_trace(times: Floats, values: Floats, ranges: Floats) -> Mask:
    """Return where each trace stayed within `QUIET_TRACE_FRACTION` of its range over the last `QUIET_TRACE_S`.

    Args:
        times: (n,) float, s.
        values: (n, k) float.
        ranges: (k,) float, unit of the values.

    Returns:
        (n, k) bool; samples earlier than `QUIET_TRACE_S` are judged by what there is.
    """
    low, high = values.copy(), values.copy()
    start = np.searchsorted(times, times - QUIET_TRACE_S - _TICK)
    for back in range(1, int((np.arange(len(times)) - start).max(initial=0)) + 1):
        earlier = np.maximum(np.arange(len(times)) - back, start)
        np.minimum(low, values[earlier], out=low)
        np.maximum(high, values[earlier], out=high)
    return np.asarray(high - low <= QUIET_TRACE_FRACTION * ranges)


@dataclass(frozen=True)
class ChannelMetrics:
    """One row of the validation table; lengths in `unit`."""

    unit: str
    """`mm` for a cable, `mrad` for the abduction."""
    excursion_model: float
    """Greatest less smallest sensor value of the simulator while this channel was swept."""
    excursion_hand: float
    """The same of the travel that the encoder reports."""
    tracking_rms: float
    """Root mean square of hand less simulator over the settled samples of the whole run."""
    rise_model_ms: float
    """Median 10-90 % rise over the matched steps, in whole integrator steps as the paper counts it; NaN without any."""
    rise_hand_ms: float
    """The same of the hand, linear between the encoder samples, which are coarse against it; NaN of a late host too."""
    overshoot_hand_percent: float
    """Greatest overshoot of the hand over the matched steps, of the step; NaN when no step matched."""
    settled_percent: float
    """Settled samples, of all samples of the run."""
    matched_steps: int
    """Steps of this channel that simulator and hand both answered."""
    worst_residual: float
    """Settled residual (hand less simulator) of greatest magnitude, with its sign."""
    worst_residual_at_s: float
    """Time of that residual, s."""


def staircase_metrics(recording: Recording) -> dict[Channel, ChannelMetrics]:
    """Evaluate a recording of the staircase (`Staircase` in `check.py`).

    Raises:
        KeyError: the recording lacks a series; it was made by another experiment.
        CannotBeMeasuredError: it is too short to evaluate.
    """
    command, hand, model, travel = (recording[name] for name in ("command", "hand", "model", "travel"))
    residual, settled = residuals(recording)
    steps = find_steps(command.times, command.values)
    rows: dict[Channel, ChannelMetrics] = {}
    for channel in Channel:
        own = [step for step in steps if step.channel == channel]
        if not own:
            raise CannotBeMeasuredError(
                f"{channel.label} is never commanded in this recording; it is no complete staircase"
            )
        matched = _matched(own, (model.times, model.values[:, channel]), (hand.times, hand.values[:, channel]))
        unit, scale = display_unit(command.units[channel])
        mask = settled[:, channel]
        kept = scale * residual[mask, channel]
        if not kept.size:
            raise CannotBeMeasuredError(f"{channel.label} has no settled sample; hold each level for more than 0.4 s")
        worst = int(np.argmax(np.abs(kept)))
        rows[channel] = ChannelMetrics(
            unit=unit,
            excursion_model=scale * _span(model.times, model.values[:, channel], own),
            excursion_hand=scale * _span(travel.times, travel.values[:, channel], own),
            tracking_rms=rms(kept),
            rise_model_ms=1e3 * _median([m.rise_on_grid for m, _ in matched]),
            rise_hand_ms=1e3 * median_rise([h for _, h in matched]),
            overshoot_hand_percent=1e2 * max((h.overshoot for _, h in matched), default=np.nan),
            settled_percent=100.0 * float(mask.mean()),
            matched_steps=len(matched),
            worst_residual=float(kept[worst]),
            worst_residual_at_s=float(hand.times[mask][worst]),
        )
    return rows


def _matched(
    steps: list[CommandStep], model: tuple[Floats, Floats], hand: tuple[Floats, Floats]
) -> list[tuple[Response, Response]]:
    pairs = [(step, respond(step, *model), respond(step, *hand)) for step in steps]
    return [(m, h) for step, m, h in pairs if m.answers(step) and h.answers(step)]


def _span(times: Floats, values: Floats, steps: list[CommandStep]) -> float:
    require(bool(((times >= steps[0].start) & (times <= steps[-1].end)).any()), "samples of a sweep")
    inside = (times >= steps[0].start) & (times <= steps[-1].end)
    return float(np.ptp(values[inside]))


def _median(values: list[float]) -> float:
    return float(np.median(values)) if values else np.nan
