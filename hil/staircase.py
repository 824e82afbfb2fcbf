"""The paper's dynamic validation: one command stream drives the simulator and the hand through every channel's range.

The stream is data (`Staircase.commands`), the experiment a function from a target and a simulator to a recording.
The paper publishes neither the number of levels nor their timing; 20 levels up and down reproduce its simulated rise
times, and 0.48 s leave settled samples (0.4 s after a change) on every level.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aero.channels import Channel
from hil.reach import calibrated_range, reachable
from hil.recorder import Progress, Recorder, silent
from hil.recording import Recording
from hil.simulator import MODEL_STEP_S, Simulator
from hil.target import Target

Floats = NDArray[np.float64]

CURRENT_EVERY = 5
TEMPERATURE_EVERY = 50
"""Samples of the encoders from one reading of the currents or temperatures to the next."""


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
    simulator: Simulator,
    plan: Staircase | None = None,
    *,
    progress: Progress = silent,
) -> Recording:
    """Drive simulator and hand through the staircase.

    At every sample the encoders are read first and the command is sent after, as a policy does.

    Args:
        target: the hand; it moves through its whole range.
        simulator: the routed hand of the same side.
        plan: the stream; the default takes 135 s of hand time.
        progress: called once a sample.

    Returns:
        A recording with `command`, `model`, `hand` and `goal` (simulator length, m or rad; `goal` is what the map makes
        of the command there and back, hence `hand` if the hand were perfect), `travel` (cable wound in, m, or rad),
        `codes` and `command_codes` (u16), `currents` (A) and `temperatures` (degC).
    """
    plan = plan or Staircase()
    hand, clock, codec = target.hand, target.clock, target.map
    opened, closed = reachable(codec, calibrated_range(simulator))
    times, commands = plan.commands(opened, closed)
    goals, saturated = codec.saturating_codes(codec.angles_from_travel(codec.travel_from_lengths(commands)))
    recorder = Recorder(target)
    for channel in Channel:
        if saturated[:, channel].any():
            recorder.note(
                f"{channel.label} waits at the end of its command window in {saturated[:, channel].sum()} of "
                f"{len(times)} samples: the map asks it to follow another channel's sweep beyond"
            )
    simulator.reset()
    for i, t in enumerate(times):
        clock.sleep_until(recorder.start + t)
        recorder.add("codes", clock.now(), hand.read_codes())
        recorder.add("command_codes", clock.now(), goals[i])
        hand.command_codes(goals[i])
        if i % CURRENT_EVERY == 0:
            recorder.add("currents", clock.now(), hand.read_currents())
        if i % TEMPERATURE_EVERY == 0:
            recorder.add("temperatures", clock.now(), hand.read_temperatures())
        simulator.command(commands[i])
        for step in range(round(plan.sample_period_s / MODEL_STEP_S)):
            recorder.add("model", recorder.start + t + step * MODEL_STEP_S, simulator.lengths())
            simulator.advance(MODEL_STEP_S)
        progress((i + 1) / len(times), _doing(commands[i], opened))
    for name, source in (("hand", "codes"), ("goal", "command_codes")):
        recorder.derive(name, source, codec.lengths_from_codes)
    recorder.derive("travel", "codes", lambda codes: codec.travel_from_angles(codec.angles_from_codes(codes)))
    recorder.derive("command", "command_codes", lambda _: commands)
    return recorder.finish("staircase", dataclasses.asdict(plan))


def _doing(command: Floats, opened: Floats) -> str:
    moved = np.flatnonzero(command != opened)
    return Channel(moved[0]).label if moved.size else "open hand"


def _is_multiple(value: float, unit: float) -> bool:
    return abs(value / unit - round(value / unit)) < 1e-9
