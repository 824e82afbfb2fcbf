"""Where a channel's settled residual comes from.

Two cuts through the same numbers: by source (the simulator's own static error, the map, the hand's), which add up
sample by sample, and by part of the run (the channel's own sweep up, down, its end stop, the others' sweeps).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from aero.channels import Channel
from hil.checks.shared.experiment import Details
from hil.checks.shared.signals import display_unit, find_steps, rms
from hil.checks.staircase.tracking import residuals, staircase_metrics
from hil.recordings.recording import Recording

SHARE_WORTH_NAMING = 0.1
"""Part of the summed squares below which a contribution is not mentioned."""

PARTS = {
    "closing": "while it closes",
    "opening": "while it opens",
    "stopped": "where it stands still although the command moves on",
    "others": "while others are swept",
}
SOURCES = ("simulator", "map", "hand")
TEXT = (
    "The residual is the sum of three errors: the simulator's actuator stops short of its command, the map's two "
    "directions are separate fits on the thumb, and the hand stops short of its goal under friction and springs. The "
    "first three numbers are the RMS of each; the last column says when the squares of the residual arise."
)


@dataclass(frozen=True)
class Attribution:
    """One channel's settled residual, taken apart; lengths in the channel's display unit."""

    source: dict[str, float]
    """RMS over the whole run of each of `SOURCES`; as signed numbers they add up to the residual."""
    share: dict[str, float]
    """Part of the run (a key of `PARTS`) to its share of the summed squares; they add to one."""
    worst_other: Channel | None
    """The channel during whose sweep the residual was largest, None when it was zero throughout."""

    @property
    def where(self) -> str:
        """Say in which parts of the run the residual arises, the largest share of its squares first."""
        named = sorted(
            (part for part in self.share if self.share[part] >= SHARE_WORTH_NAMING), key=lambda part: -self.share[part]
        )
        texts = [f"{self.share[part]:.0%} {PARTS[part]}" for part in named]
        if "others" in named and self.worst_other is not None:
            texts[named.index("others")] += f" (most: {self.worst_other.label})"
        return ", ".join(texts)


def residual_sources(recording: Recording) -> dict[Channel, Attribution]:
    """Split each channel's settled residual of a staircase recording by what was going on."""
    command, hand = recording["command"], recording["hand"]
    residual, settled = residuals(recording)
    in_force = np.maximum(np.searchsorted(command.times, hand.times, side="right") - 1, 0)
    commanded, goal = command.values[in_force], recording["goal"].values[in_force]
    sources = {"simulator": commanded - (hand.values - residual), "map": goal - commanded, "hand": hand.values - goal}
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
            source={name: scale * rms(part[settled[:, channel], channel]) for name, part in sources.items()},
            share={part: value / total if total else 0.0 for part, value in squares.items()},
            worst_other=worst if by_sweep[worst] else None,
        )
    return found


def details(recording: Recording) -> Details:
    """Return each channel's tracking error, taken apart."""
    rows, attributions = staircase_metrics(recording), residual_sources(recording)
    return Details(
        "What the tracking error consists of",
        TEXT,
        ("Channel", "Tracking RMS", *(f"{source.capitalize()} alone" for source in SOURCES), "When"),
        tuple(
            (
                f"{channel.title}, {display_unit(unit)[0]}",
                f"{rows[channel]['tracking_rms']:.2f}",
                *(f"{attributions[channel].source[source]:.2f}" for source in SOURCES),
                attributions[channel].where,
            )
            for channel, unit in zip(Channel, recording["command"].units, strict=True)
        ),
    )
