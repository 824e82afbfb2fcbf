"""Metrics of a staircase recording, as defined by the paper's dynamic validation.

All functions are pure functions of the recording's series: `command` and `hand` (simulator length of each channel, m or
rad), `model` (simulator length on the simulator's own time base) and `travel` (cable wound onto the spools, m or rad).
"""

import numpy as np
from numpy.typing import NDArray

from aero.channels import Channel
from aero.floats import Floats
from hil.checks.shared.experiment import Details, require
from hil.checks.shared.signals import MILLI, CommandStep, at_times, find_steps, in_force, rms
from hil.checks.staircase.rise_time import Response, median_rise, respond
from hil.recordings.errors import CannotBeMeasuredError
from hil.recordings.recording import Recording

Mask = NDArray[np.bool_]

QUIET_COMMAND_S = 0.4
"""Time without a command change before a sample counts as settled, s. Source: paper, section "Dynamic validation"."""
QUIET_TRACE_S = 0.1
"""Window before a settled sample in which neither trace moves by more than `QUIET_TRACE_FRACTION`, s."""
QUIET_TRACE_FRACTION = 0.005
"""Fraction of its range that a trace may move within `QUIET_TRACE_S`."""

TEXT = (
    "The residual is the sum of three errors: the simulator's actuator stops short of its command, the map's two "
    "directions are separate fits on the thumb, and the hand stops short of its goal under friction and springs. The "
    "last three numbers are the RMS of each."
)
_TICK = 1e-6
"""Tolerance of time comparisons, s: far below a sample, far above rounding."""


def residuals(recording: Recording) -> tuple[Floats, Mask]:
    """Return hand minus simulator at the hand's sample times, (n, 7) m or rad, and the mask of settled samples."""
    command, hand = recording["command"], recording["hand"]
    model = at_times(recording["model"].times, recording["model"].values, hand.times)
    ranges = np.ptp(command.values, axis=0)
    quiet = quiet_command(command.times, command.values, hand.times)[:, None]
    still = quiet_trace(hand.times, hand.values, ranges) & quiet_trace(hand.times, model, ranges)
    return hand.values - model, quiet & still


def quiet_command(times: Floats, command: Floats, at: Floats) -> Mask:
    """Return the mask of the times `at` (m,) without a command change in the last `QUIET_COMMAND_S`.

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
    """Return the mask of samples within `QUIET_TRACE_FRACTION` of the trace's range over the last `QUIET_TRACE_S`.

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


def staircase_metrics(recording: Recording) -> dict[Channel, dict[str, float]]:
    """Evaluate a recording of the staircase: each channel's table row, by metric.

    Lengths are in mm, of the abduction in mrad. The simulator's rise is in whole integrator steps, as in the paper. The
    hand's rise is interpolated linearly between the coarser encoder samples, and missing if the host was late in most
    steps. Excursions are of the channel's own sweep, `tracking_rms` is of the whole run.

    Raises:
        KeyError: the recording lacks a series, because another experiment made it.
        CannotBeMeasuredError: the recording is too short.
    """
    command, hand, model, travel = (recording[name] for name in ("command", "hand", "model", "travel"))
    residual, settled = residuals(recording)
    steps = find_steps(command.times, command.values)
    rows: dict[Channel, dict[str, float]] = {}
    for channel in Channel:
        own = [step for step in steps if step.channel == channel]
        if not own:
            raise CannotBeMeasuredError(
                f"{channel.label} is never commanded in this recording; it is no complete staircase"
            )
        matched = _matched(own, (model.times, model.values[:, channel]), (hand.times, hand.values[:, channel]))
        mask = settled[:, channel]
        kept = MILLI * residual[mask, channel]
        if not kept.size:
            raise CannotBeMeasuredError(f"{channel.label} has no settled sample; hold each level for more than 0.4 s")
        worst = int(np.argmax(np.abs(kept)))
        rise = median_rise([h for _, h in matched])
        host_was_late = bool(matched) and np.isnan(rise)
        rows[channel] = {
            "excursion_model": MILLI * _span(model.times, model.values[:, channel], own),
            "excursion_hand": MILLI * _span(travel.times, travel.values[:, channel], own),
            "tracking_rms": rms(kept),
            "rise_model_ms": 1e3 * float(np.median([m.rise_on_grid for m, _ in matched])) if matched else np.nan,
            **({} if host_was_late else {"rise_hand_ms": 1e3 * rise}),
            "overshoot_hand_percent": 1e2 * max((h.overshoot for _, h in matched), default=np.nan),
            "settled_percent": 100.0 * float(mask.mean()),
            "matched_steps": float(len(matched)),
            "worst_percent": 100.0 * abs(float(kept[worst])) / (MILLI * float(np.ptp(command.values[:, channel]))),
            "worst_residual_at_s": float(hand.times[mask][worst]),
        }
    return rows


def _matched(
    steps: list[CommandStep], model: tuple[Floats, Floats], hand: tuple[Floats, Floats]
) -> list[tuple[Response, Response]]:
    pairs = [(step, respond(step, *model), respond(step, *hand)) for step in steps]
    return [(m, h) for step, m, h in pairs if m.answers(step) and h.answers(step)]


def _span(times: Floats, values: Floats, steps: list[CommandStep]) -> float:
    inside = (times >= steps[0].start) & (times <= steps[-1].end)
    require(bool(inside.any()), "samples of a sweep")
    return float(np.ptp(values[inside]))


def residual_sources(recording: Recording) -> dict[Channel, dict[str, float]]:
    """Return the settled RMS of each error source by channel, mm or mrad; the signed errors add up to the residual."""
    hand = recording["hand"]
    residual, settled = residuals(recording)
    commanded, goal = (in_force(recording["command"], hand.times), in_force(recording["goal"], hand.times))
    sources = {"simulator": commanded - (hand.values - residual), "map": goal - commanded, "hand": hand.values - goal}
    return {
        channel: {name: MILLI * rms(of[settled[:, channel], channel]) for name, of in sources.items()}
        for channel in Channel
    }


def details(recording: Recording) -> Details:
    """Return each channel's tracking error, split by source."""
    rows, sources, units = staircase_metrics(recording), residual_sources(recording), recording["command"].units
    return Details(
        "What the tracking error consists of",
        TEXT,
        ("Channel", "Tracking RMS", *(f"{name.capitalize()} alone" for name in sources[Channel.INDEX])),
        tuple(
            (
                f"{channel.title}, m{unit}",
                f"{rows[channel]['tracking_rms']:.2f}",
                *(f"{value:.2f}" for value in sources[channel].values()),
            )
            for channel, unit in zip(Channel, units, strict=True)
        ),
    )
