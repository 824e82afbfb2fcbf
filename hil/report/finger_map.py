"""Finger map of a report: each channel's verdict, or the reason for a missing verdict."""

from dataclasses import dataclass
from typing import Literal

from aero.channels import Channel
from hil.verdict.judged_run import Validation

DigitState = Literal["pass", "fail", "partly", "none"]
WORDS: dict[DigitState, str] = {
    "pass": "all checks passed",
    "fail": "checks failed",
    "partly": "passed until the run was aborted",
    "none": "not judged",
}
MARKS: dict[DigitState, str] = {"pass": "\u2713", "fail": "\u2717", "partly": "\u25d0", "none": "\u2013"}
"""Symbol beside each name, so that colour is never the only sign of a verdict."""
DIGITS: dict[Channel, tuple[tuple[float, float], ...]] = {
    Channel.INDEX: ((21.6, -138.6), (23.8, -179.5), (25.0, -200.2), (26.1, -222.9)),
    Channel.MIDDLE: ((-1.5, -138.8), (-1.5, -179.7), (-1.5, -200.4), (-1.5, -223.1)),
    Channel.RING: ((-24.6, -138.6), (-26.8, -179.5), (-28.0, -200.2), (-29.1, -222.9)),
    Channel.PINKY: ((-47.3, -127.2), (-51.6, -168.0), (-53.9, -188.6), (-56.1, -211.3)),
    Channel.THUMB_ABDUCTION: ((16.3, -73.8), (33.8, -72.5)),
    Channel.THUMB_CMC_FLEXION: ((33.8, -72.5), (50.9, -98.7)),
    Channel.THUMB_FLEXOR: ((50.9, -98.7), (64.8, -120.9), (73.3, -144.3)),
}
"""Joints and tip of each channel's digit, (right, down) in mm: palm view of a right hand with the model's lengths. A
left hand is its mirror image."""


@dataclass(frozen=True)
class ChannelVerdict:
    """Verdict of a run on one channel."""

    state: DigitState
    words: str
    reason: str = ""
    """Reason for a missing verdict; empty for a judged channel."""


def verdicts(validation: Validation) -> dict[Channel, ChannelVerdict]:
    """Return the verdict of each channel, `none` without checks, or if a fault elsewhere explains its failures.

    A faulty driver, link or supply makes checks of healthy fingers fail.
    """
    return {channel: _verdict(validation, channel) for channel in Channel}


def _verdict(validation: Validation, channel: Channel) -> ChannelVerdict:
    diagnosis = validation.diagnosis
    passed = [finding.passed for finding in validation.findings if finding.subject == channel.label]
    if not passed:
        return ChannelVerdict("none", WORDS["none"], "no check of the channel was run")
    if not all(passed):
        words = f"{passed.count(False)} of {len(passed)} checks failed"
        # Failures that the diagnosis leaves unexplained count against the channel itself.
        if diagnosis.suspects and channel not in diagnosis.channels and not _unexplained(validation, channel):
            return ChannelVerdict("none", words, f"its failures point to: {diagnosis.place}")
        return ChannelVerdict("fail", words)
    if channel in diagnosis.channels:
        return ChannelVerdict("fail", f"its {len(passed)} checks passed, one of the whole hand failed for it")
    state: DigitState = "pass" if validation.end.finding is None else "partly"
    return ChannelVerdict(state, f"{WORDS[state]} ({len(passed)})")


def _unexplained(validation: Validation, channel: Channel) -> bool:
    return any(finding.subject == channel.label for finding in validation.diagnosis.unexplained)
