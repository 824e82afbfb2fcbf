"""Where a channel's settled residual comes from: its own sweep up, its own sweep down, its end stop, the others."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from aero.channels import Channel
from hil.metrics import ChannelMetrics, display_unit, residuals, rms
from hil.recording import Recording
from hil.steps import find_steps

SHARE_WORTH_NAMING = 0.1
"""Part of the summed squares below which a contribution is not mentioned."""

PARTS = {
    "closing": "static error while closing (friction and return spring against a servo without integral action)",
    "opening": "static error while opening",
    "stopped": "levels at which the hand stands still although the command moves on (end stop or blocked joint)",
    "others": "motion or offset while other channels are swept (coupling, or a wrong zero)",
}


@dataclass(frozen=True)
class Attribution:
    """One channel's settled residual, by part of the run; lengths in the channel's display unit."""

    share: dict[str, float]
    """Part of the run (a key of `PARTS`) to its share of the summed squares; they add to one."""
    rms: dict[str, float]
    """Part of the run to its own RMS; NaN where it has no settled sample."""
    worst_other: Channel | None
    """The channel during whose sweep the residual was largest, None when it was zero throughout."""

    def sentence(self, row: ChannelMetrics) -> str:
        """Say in words what the channel's RMS consists of, the largest part first."""
        named = sorted(
            (part for part in self.share if self.share[part] >= SHARE_WORTH_NAMING), key=lambda part: -self.share[part]
        )
        texts = []
        for part in named:
            text = f"{self.share[part]:.0%} from {PARTS[part]}, {self.rms[part]:.2f} {row.unit} RMS there"
            if part == "others" and self.worst_other is not None:
                text += f", most during the sweep of {self.worst_other.label}"
            texts.append(text)
        return "; ".join(texts) + "."


def attribute(recording: Recording) -> dict[Channel, Attribution]:
    """Split each channel's settled residual of a staircase recording by what was going on."""
    command, hand = recording["command"], recording["hand"]
    residual, settled = residuals(recording)
    steps = find_steps(command.times, command.values)
    sweeping = np.full(len(hand.times), -1)
    closing = np.zeros(len(hand.times), bool)
    stopped = np.zeros(len(hand.times), bool)
    for step in steps:
        inside = (hand.times >= step.start) & (hand.times < step.end)
        sweeping[inside] = step.channel
        far = abs(step.after - command.values[0, step.channel])
        closing[inside] = far > abs(step.before - command.values[0, step.channel])
        moved = np.ptp(hand.values[inside, step.channel]) if inside.any() else 0.0
        stopped[inside] = moved < 0.25 * abs(step.after - step.before)
    found = {}
    for channel in Channel:
        _, scale = display_unit(command.units[channel])
        own = sweeping == channel
        masks = {
            "closing": own & closing & ~stopped,
            "opening": own & ~closing & ~stopped,
            "stopped": own & stopped,
            "others": ~own,
        }
        error = scale * residual[:, channel]
        kept = {part: error[mask & settled[:, channel]] for part, mask in masks.items()}
        squares = {part: float(np.sum(np.square(values))) for part, values in kept.items()}
        total = sum(squares.values())
        by_sweep = {
            other: float(np.sum(np.square(error[(sweeping == other) & settled[:, channel]])))
            for other in Channel
            if other is not channel
        }
        worst = max(by_sweep, key=lambda other: by_sweep[other])
        found[channel] = Attribution(
            share={part: value / total if total else 0.0 for part, value in squares.items()},
            rms={part: rms(values) for part, values in kept.items()},
            worst_other=worst if by_sweep[worst] else None,
        )
    return found
