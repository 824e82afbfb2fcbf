"""What the tracking error consists of, as a table of the page."""

from __future__ import annotations

from hil.checks.shared.experiment import Details
from hil.checks.staircase.residual_sources import SOURCES, residual_sources
from hil.checks.staircase.tracking import staircase_metrics
from hil.recordings.recording import Recording

TEXT = (
    "The residual is the sum of three errors: the simulator's actuator stops short of its command, the map's two "
    "directions are separate fits on the thumb, and the hand stops short of its goal under friction and springs. The "
    "first three numbers are the RMS of each; the last column says when the squares of the residual arise."
)


def details(recording: Recording) -> Details:
    """Return each channel's tracking error, taken apart."""
    attributions = residual_sources(recording)
    return Details(
        "What the tracking error consists of",
        TEXT,
        ("Channel", "Tracking RMS", *(f"{source.capitalize()} alone" for source in SOURCES), "Own sweep RMS", "When"),
        tuple(
            (
                f"{channel.title}, {row.unit}",
                f"{row.tracking_rms:.2f}",
                *(f"{attributions[channel].source[source]:.2f}" for source in SOURCES),
                f"{row.sweep_rms:.2f}",
                attributions[channel].where,
            )
            for channel, row in staircase_metrics(recording).items()
        ),
    )
