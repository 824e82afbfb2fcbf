"""The paper's dynamic validation: one command stream drives the simulator and the hand through every channel's range.

The stream is data (`Staircase.commands`), the experiment a function from a target and a simulator to a recording.
The paper publishes neither the number of levels nor their timing; 20 levels up and down reproduce its simulated rise
times, and 0.48 s leave settled samples (0.4 s after a change) on every level.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aero.channels import Channel
from aero.protocol import MAX_CODE
from hil.checks.shared.experiment import Details, Measured, map_of
from hil.checks.shared.side_by_side import MODEL_STEP_S, SimulatedHand, follow
from hil.checks.staircase.cable_loads import loads
from hil.checks.staircase.reachable_range import calibrated_range, reachable
from hil.checks.staircase.residual_sources import SOURCES, residual_sources
from hil.checks.staircase.tracking import ChannelMetrics, staircase_metrics
from hil.recordings.recorder import Progress, Recorder, silent
from hil.recordings.recording import Recording
from hil.targets.target import Target
from model import RoutedHand

Floats = NDArray[np.float64]

FULL: Mapping[Channel, float] = dict.fromkeys(Channel, 1.0)
"""Every channel through its whole range."""
FURTHEST = (1.0,) * len(Channel)
"""How far each channel is sent at most, part of its window, command order."""
TEXT = (
    "The residual is the sum of three errors: the simulator's actuator stops short of its command, the map's two "
    "directions are separate fits on the thumb, and the hand stops short of its goal under friction and springs. The "
    "first three numbers are the RMS of each; the last column says when the squares of the residual arise."
)


@dataclass(frozen=True)
class Staircase:
    """The command stream: each channel in turn climbs to its closed end in equal levels and back."""

    levels: int = 20
    """Levels from open to closed."""
    hold_s: float = 0.48
    """Time at each level, a multiple of the sample period."""
    sample_period_s: float = 0.02
    """Time from one encoder reading and command to the next, a multiple of `MODEL_STEP_S`."""
    lead_s: float = 0.96
    """Time at the open hand before the first level, for everything to come to rest."""

    def __post_init__(self) -> None:
        for name in ("hold_s", "lead_s"):
            if not _is_multiple(getattr(self, name), self.sample_period_s):
                raise ValueError(f"{name} must be a multiple of the sample period, {self.sample_period_s} s")
        if not _is_multiple(self.sample_period_s, MODEL_STEP_S):
            raise ValueError(f"the sample period must be a multiple of the simulator's step, {MODEL_STEP_S} s")
        if self.levels < 1:
            raise ValueError(f"a staircase has at least one level, not {self.levels}")

    @property
    def duration_s(self) -> float:
        """Hand time from the first command to the last sample, s."""
        return self.lead_s + len(Channel) * 2 * self.levels * self.hold_s

    def commands(self, open_lengths: Floats, closed_lengths: Floats) -> tuple[Floats, Floats]:
        """Return the stream.

        Args:
            open_lengths: (7,) float, m and rad; where every channel waits while another is swept.
            closed_lengths: (7,) float, the far end of each channel's sweep.

        Returns:
            Times (n,) in s from zero, and commanded lengths (n, 7).
        """
        up = np.arange(1, self.levels + 1) / self.levels
        sweep = np.repeat(np.append(up, up[-2::-1]), round(self.hold_s / self.sample_period_s))
        sweep = np.append(sweep, np.zeros(round(self.hold_s / self.sample_period_s)))
        lead = round(self.lead_s / self.sample_period_s)
        fractions = np.vstack([np.zeros((lead, len(Channel))), np.kron(np.eye(len(Channel)), sweep[:, None])])
        times = self.sample_period_s * np.arange(len(fractions), dtype=float)
        return times, open_lengths + fractions * (closed_lengths - open_lengths)


def run_staircase(
    target: Target,
    recorder: Recorder,
    simulator: SimulatedHand,
    plan: Staircase,
    *,
    reach: Mapping[Channel, float] = FULL,
    progress: Progress = silent,
) -> None:
    """Drive simulator and hand through the staircase; what `follow` leaves is in the recorder.

    At every sample the encoders are read first and the command is sent after, as a policy does.

    Args:
        target: the hand; it moves through its whole range.
        recorder: begun here.
        simulator: the routed hand of the same side.
        plan: the stream.
        reach: part of its range over which each channel is swept, above 0 and at most 1.
        progress: called once a sample.
    """
    opened, closed = reachable(target.map, calibrated_range(simulator))
    shares = np.array([reach[channel] for channel in Channel])
    _, commands = plan.commands(opened, opened + shares * (closed - opened))

    def doing(i: int) -> str:
        moved = np.flatnonzero(commands[i] != opened)
        return Channel(moved[0]).label if moved.size else "open hand"

    follow(
        target,
        recorder,
        simulator,
        commands,
        period_s=plan.sample_period_s,
        parameters=dataclasses.asdict(plan),
        doing=doing,
        progress=progress,
    )


def run(target: Target, recorder: Recorder, progress: Progress) -> None:
    """Run the default staircase, 135 s of hand time, beside the routed hand of the target's side."""
    run_staircase(target, recorder, RoutedHand(target.side), Staircase(), progress=progress)


def _is_multiple(value: float, unit: float) -> bool:
    return abs(value / unit - round(value / unit)) < 1e-9


def measure(recording: Recording) -> Measured:
    """Return each channel's row of the validation table, and each cable's take-up, spring load and friction.

    The rise of a channel is withheld where the host was late in most of its steps.
    """
    found = {channel.label: channel_numbers(row) for channel, row in staircase_metrics(recording).items()}
    ranges = np.ptp(recording["command"].values, axis=0) * 1e3
    spans = map_of(recording.header).window.spans_counts()
    for channel in Channel:
        row = found[channel.label]
        row["resolution"] = resolution(recording["codes"].values[:, channel], int(spans[channel]))
        row["worst_percent"] = 100.0 * abs(row.pop("worst_residual")) / float(ranges[channel])
    for channel, load in loads(recording).items():
        found[channel.label] |= {
            "take_up": load.take_up_mm,
            "spring": load.spring,
            "friction": load.friction,
        }
        if channel is not Channel.THUMB_CMC_FLEXION and np.isfinite(load.spring_shape):  # of which no check judges it
            found[channel.label]["spring_shape"] = load.spring_shape
    return found


def resolution(codes: NDArray[np.float64], span_counts: int) -> float:
    """Return the resolution of readings (n,), servo counts: 95 % of the steps between distinct readings are as large.

    The board reports whole counts of the window; an encoder that has lost its lower bits moves in larger steps.
    """
    counts = np.ceil(np.unique(codes) * span_counts / MAX_CODE - 1e-9)
    steps = np.diff(np.unique(counts))
    return float(np.quantile(steps, 0.05)) if steps.size else np.nan


def channel_numbers(row: ChannelMetrics) -> dict[str, float]:
    """Return a row's numbers by metric, without the rise where the host was too late to tell it."""
    host_was_late = row.matched_steps > 0 and np.isnan(row.rise_hand_ms)
    left_out = {"unit", "rise_hand_ms"} if host_was_late else {"unit"}
    return {name: float(value) for name, value in dataclasses.asdict(row).items() if name not in left_out}


def details(recording: Recording) -> Details:
    """Return each channel's tracking error, taken apart."""
    attributions = residual_sources(recording)
    return Details(
        "What the tracking error consists of",
        TEXT,
        ("Channel", "Tracking RMS", *(f"{source.capitalize()} alone" for source in SOURCES), "When"),
        tuple(
            (
                f"{channel.title}, {row.unit}",
                f"{row.tracking_rms:.2f}",
                *(f"{attributions[channel].source[source]:.2f}" for source in SOURCES),
                attributions[channel].where,
            )
            for channel, row in staircase_metrics(recording).items()
        ),
    )
