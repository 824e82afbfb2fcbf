"""Where a channel's settled residual comes from: the simulator's own static error, the map's, the hand's."""

from __future__ import annotations

from aero.channels import Channel
from hil.checks.shared.experiment import Details
from hil.checks.shared.signals import MILLI, in_force, rms
from hil.checks.staircase.tracking import residuals, staircase_metrics
from hil.recordings.recording import Recording

TEXT = (
    "The residual is the sum of three errors: the simulator's actuator stops short of its command, the map's two "
    "directions are separate fits on the thumb, and the hand stops short of its goal under friction and springs. The "
    "last three numbers are the RMS of each."
)


def residual_sources(recording: Recording) -> dict[Channel, dict[str, float]]:
    """Return the settled RMS of each source by channel, mm or mrad; as signed numbers they add up to the residual."""
    hand = recording["hand"]
    residual, settled = residuals(recording)
    commanded, goal = (in_force(recording["command"], hand.times), in_force(recording["goal"], hand.times))
    sources = {"simulator": commanded - (hand.values - residual), "map": goal - commanded, "hand": hand.values - goal}
    return {
        channel: {name: MILLI * rms(of[settled[:, channel], channel]) for name, of in sources.items()}
        for channel in Channel
    }


def details(recording: Recording) -> Details:
    """Return each channel's tracking error, taken apart."""
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
