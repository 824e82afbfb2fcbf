"""A person's answers as numbers: 0 is what a good hand shows."""

from __future__ import annotations

from aero.channels import Channel
from hil.checks.look.questions import NO, NONE, STRAIGHT
from hil.checks.shared.experiment import Measured
from hil.recordings.recording import Recording


def measure(recording: Recording) -> Measured:
    """Return, by channel, which other digit moved, whether it starts late, is bent, or stays behind.

    Raises:
        ValueError: an answer is missing; the look was ended.
    """
    answers = recording.header.parameters
    labels = [channel.label for channel in Channel]
    wanted = ["bent", *(f"{what}_{label}" for label in labels for what in ("moved", "followed"))]
    if missing := [name for name in wanted if name not in answers]:
        raise ValueError(f"there is no answer to {missing[0]}; the look was ended before its end")
    bent = str(answers["bent"]).split()
    found: dict[str, dict[str, float]] = {}
    for channel in Channel:
        label, moved = channel.label, str(answers[f"moved_{channel.label}"])
        found[label] = {
            "another_moved": 0.0 if moved in (label, NONE) else 1.0 + labels.index(moved),
            "starts_late": float(moved == NONE),
            "stays_behind": float(answers[f"followed_{label}"] == NO),
        }
        if channel in STRAIGHT:
            found[label]["bent"] = float(label in bent)
    return found
