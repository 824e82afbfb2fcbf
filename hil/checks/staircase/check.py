"""Dynamic validation of the paper: one command stream for simulator and hand through every channel's range.

The stream is data (`Staircase.commands`), the experiment a function from a target and a simulator to a recording. The
paper publishes neither the number of levels nor their timing; 20 levels up and down reproduce its simulated rise times,
and 0.48 s per level include settled samples (0.4 s after a change).
"""

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aero.actuation import ActuationMap
from aero.channels import Channel
from aero.floats import Floats
from aero.protocol import MAX_CODE
from hil.checks.shared.experiment import Measured, Step, map_of, window_mm
from hil.checks.shared.side_by_side import MODEL_STEP_S, follow
from hil.checks.staircase.cable_loads import loads
from hil.checks.staircase.reachable_range import calibrated_range, reachable
from hil.checks.staircase.tracking import details, staircase_metrics
from hil.recordings.recorder import Progress, Recorder, silent
from hil.recordings.recording import Recording
from hil.recordings.series_layout import LABELS
from hil.targets.target import Target
from simulator.routed import RoutedHand

__all__ = ["FURTHEST", "RESOLUTION", "Staircase", "details", "measure", "run", "run_staircase", "stream"]


FULL: Mapping[Channel, float] = dict.fromkeys(Channel, 1.0)
"""Full range of every channel."""
FURTHEST = (1.0,) * len(Channel)
"""Largest commanded fraction of each channel's window, command order."""
SAMPLE_PERIOD_S = 0.02


def stream(levels: ArrayLike, hold_s: float, lead_s: float, period_s: float = SAMPLE_PERIOD_S) -> Floats:
    """Return a stream (n, 7) of fractions of each channel's range; the channels move one after another.

    Args:
        levels: (7, k) float, sequence of levels per channel; the last is 0.
        hold_s: time at each level, s, a multiple of the period.
        lead_s: time at the open hand before the first level, s.
        period_s: command period, s.
    """
    moved = np.repeat(np.asarray(levels, float), round(hold_s / period_s), axis=1)
    lead = np.zeros((round(lead_s / period_s), len(Channel)))
    alone = np.eye(len(Channel))
    return np.vstack([lead, *(np.outer(moved[channel], alone[channel]) for channel in Channel)])


@dataclass(frozen=True)
class Staircase:
    """Command stream: each channel in turn closes in equal levels and opens again."""

    levels: int = 20
    hold_s: float = 0.48
    """Time at each level, s; a multiple of the sample period."""
    sample_period_s: float = SAMPLE_PERIOD_S
    """Period of encoder readings and commands, s; a multiple of `MODEL_STEP_S`."""
    lead_s: float = 0.96
    """Settling time at the open hand before the first level, s."""

    def __post_init__(self) -> None:
        for name in ("hold_s", "lead_s"):
            if not _is_multiple(getattr(self, name), self.sample_period_s):
                raise ValueError(f"{name} must be a multiple of the sample period, {self.sample_period_s} s")
        if not _is_multiple(self.sample_period_s, MODEL_STEP_S):
            raise ValueError(f"the sample period must be a multiple of the simulator's step, {MODEL_STEP_S} s")
        if self.levels < 1:
            raise ValueError(f"a staircase needs at least one level, got {self.levels}")

    def commands(self, open_lengths: Floats, closed_lengths: Floats) -> Floats:
        """Return the stream (n, 7) of lengths, m and rad.

        Args:
            open_lengths: (7,) float, m and rad; position of a channel during the sweeps of the others.
            closed_lengths: (7,) float, m and rad; closed end of each channel's sweep.
        """
        up = np.arange(1, self.levels + 1) / self.levels
        levels = np.tile([*up, *up[-2::-1], 0.0], (len(Channel), 1))
        parts = stream(levels, self.hold_s, self.lead_s, self.sample_period_s)
        return open_lengths + parts * (closed_lengths - open_lengths)


def level_mm(firmware: str, subjects: tuple[str, ...]) -> float:
    """Return the travel of one level, mm, the largest of the channels."""
    travel = window_mm(ActuationMap.for_firmware(firmware)) / Staircase().levels
    return float(max(travel[Channel[subject.upper()]] for subject in subjects))


RESOLUTION: Mapping[str, Step] = {"rise_hand_ms": lambda _version, _subjects: 0.0, "take_up": level_mm}
"""The rise is interpolated between samples, the take-up is the last slack level."""


def run_staircase(
    target: Target,
    recorder: Recorder,
    simulator: RoutedHand,
    plan: Staircase,
    *,
    reach: Mapping[Channel, float] = FULL,
    progress: Progress = silent,
) -> None:
    """Drive simulator and hand through the staircase; the recorder gets the series of `follow`.

    Args:
        target: the hand, which moves through its whole range.
        recorder: recorder, started by this function.
        simulator: routed hand of the target's side.
        plan: parameters of the stream.
        reach: swept fraction of each channel's range, above 0 and at most 1.
        progress: called once per sample.
    """
    opened, closed = reachable(target.map, calibrated_range(simulator))
    shares = np.array([reach[channel] for channel in Channel])
    commands = plan.commands(opened, opened + shares * (closed - opened))

    moved = commands != opened
    names = np.where(moved.any(axis=1), np.array(LABELS)[moved.argmax(axis=1)], "open hand")

    follow(
        target,
        recorder,
        simulator,
        commands,
        period_s=plan.sample_period_s,
        parameters=dataclasses.asdict(plan),
        doing=names.tolist().__getitem__,
        progress=progress,
    )


def run(target: Target, recorder: Recorder, progress: Progress) -> None:
    """Run the default staircase (135 s of hand time) beside the routed hand of the target's side."""
    run_staircase(target, recorder, RoutedHand(target.side), Staircase(), progress=progress)


def _is_multiple(value: float, unit: float) -> bool:
    return abs(value / unit - round(value / unit)) < 1e-9


def measure(recording: Recording) -> Measured:
    """Return each channel's row of the validation table, and each cable's take-up, spring load and friction."""
    found = {channel.label: row for channel, row in staircase_metrics(recording).items()}
    spans = map_of(recording.header).window.spans_counts()
    for channel in Channel:
        found[channel.label]["resolution"] = resolution(recording["codes"].values[:, channel], int(spans[channel]))
    for channel, load in loads(recording).items():
        found[channel.label] |= {"take_up": load.take_up_mm, "spring": load.spring, "friction": load.friction}
        if channel is not Channel.THUMB_CMC_FLEXION and np.isfinite(load.spring_shape):  # no limit
            found[channel.label]["spring_shape"] = load.spring_shape
    return found


def resolution(codes: NDArray[np.float64], span_counts: int) -> float:
    """Return the resolution of readings (n,), servo counts: the 5 % quantile of steps between distinct readings.

    The board reports whole counts of the window; an encoder without its lower bits moves in larger steps.
    """
    counts = np.ceil(np.unique(codes) * span_counts / MAX_CODE - 1e-9)
    steps = np.diff(np.unique(counts))
    return float(np.quantile(steps, 0.05)) if steps.size else np.nan
