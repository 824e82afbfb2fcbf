"""What a staircase recording measures, and what each number means when it is off."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from aero.channels import Channel
from aero.protocol import MAX_CODE
from hil.checks.shared import subjects
from hil.checks.shared.experiment import Measured, Metric, map_of
from hil.checks.staircase.cable_loads import loads
from hil.checks.staircase.tracking import ChannelMetrics, staircase_metrics
from hil.recordings.recording import Recording


def measure(recording: Recording) -> Measured:
    """Return each channel's row of the validation table, and each cable's take-up, spring load and friction."""
    found = {channel.label: _numbers(row) for channel, row in staircase_metrics(recording).items()}
    ranges = np.ptp(recording["command"].values, axis=0) * 1e3
    spans = map_of(recording.header).window.spans_counts()
    for channel in Channel:
        row = found[channel.label]
        row["settled_percent"] = 100.0 * row["settled_samples"] / len(recording["hand"].times)
        row["resolution"] = resolution(recording["codes"].values[:, channel], int(spans[channel]))
        row["worst_percent"] = 100.0 * abs(row["worst_residual"]) / float(ranges[channel])
    for channel, load in loads(recording).items():
        found[channel.label] |= {"take_up": load.take_up_mm, "spring": load.spring, "friction": load.friction}
    return found


def resolution(codes: NDArray[np.float64], span_counts: int) -> float:
    """Return the coarsest grid, in servo counts, on which nineteen of twenty differences of readings (n,) lie.

    The board reports whole counts of the window; an encoder that has lost its lower bits moves in larger steps.
    """
    counts = np.ceil(np.unique(codes) * span_counts / MAX_CODE - 1e-9)
    steps = np.diff(np.unique(counts))
    return float(np.quantile(steps, 0.05)) if steps.size else np.nan


def _numbers(row: ChannelMetrics) -> dict[str, float]:
    return {name: float(value) for name, value in dataclasses.asdict(row).items() if name != "unit"}


METRICS = (
    Metric(
        "tracking_rms",
        "mm",
        subjects.FINGERS,
        (
            "The finger does not come to rest where the simulator does: a wrong zero, cable take-up, "
            "friction, or a spool that slips."
        ),
        (
            "Look at the channel's sweep. An offset at every level is a wrong zero: home the hand. A gap "
            "between the way up and the way down is friction or a loose cable: free the joints, then re-"
            "tension. An error that grows along the sweep is a slipping spool or the wrong map."
        ),
    ),
    Metric(
        "tracking_rms",
        "mrad",
        ("thumb_abduction",),
        "The thumb's abduction does not come to rest where the simulator does.",
        (
            "An offset of 173 mrad (9.93 degrees) is the wrong command window: firmware 0.2.0 homed against "
            "not homed. Otherwise check the linkage for play."
        ),
    ),
    Metric(
        "tracking_rms",
        "mm",
        ("thumb_cmc_flexion",),
        ("CMC flexion does not follow: blocked by the palm too early, a loose cable, or the wrong command window."),
        (
            "If only the closed levels are off, look for what the thumb meets. If all are off by 1.6 mm (9.93"
            " degrees of spool), the map is for another firmware state: home the hand, or name its firmware."
        ),
    ),
    Metric(
        "tracking_rms",
        "mm",
        ("thumb_flexor",),
        "The flexor cable does not follow, or moves while CMC flexion is swept.",
        (
            "Motion during the CMC sweep is the known first-order coupling; more of it than 2 mm is a cable "
            "off its CMC pulley."
        ),
    ),
    Metric(
        "rise_hand_ms",
        "ms",
        subjects.CHANNELS,
        "The servo answers slower than its motor or its motion profile allows, or implausibly fast.",
        (
            "Slow on every channel: a speed limit left from another program (restart the board), a low "
            "supply, or a firmware with a profile (`pre`). Slow on one: friction, or a servo that is hot."
        ),
    ),
    Metric(
        "overshoot_hand_percent",
        "%",
        subjects.CHANNELS,
        "The servo swings past its goal: its damping or its firmware has been changed.",
        "Restore the servo's PID defaults; check that the supply does not sag.",
    ),
    Metric(
        "excursion_hand",
        "mm",
        subjects.FINGERS,
        "The finger does not travel from open to fist.",
        (
            "Too little: something blocks it, or the cable is too short. All of the 45.26 mm: it never met "
            "its end stop, so the cable is loose or off its spool."
        ),
    ),
    Metric(
        "excursion_hand",
        "mrad",
        ("thumb_abduction",),
        "The thumb does not abduct over its range.",
        "Look for what it meets; check the linkage screw.",
    ),
    Metric(
        "excursion_hand",
        "mm",
        ("thumb_cmc_flexion",),
        "CMC flexion does not travel.",
        "Look for what the thumb meets when it is not abducted; re-tension the cable.",
    ),
    Metric(
        "excursion_hand",
        "mm",
        ("thumb_flexor",),
        "The thumb's flexor does not travel.",
        "Look for what the thumb meets; re-tension the cable.",
    ),
    Metric(
        "matched_steps",
        "of 40 steps",
        subjects.CHANNELS,
        "The hand does not follow most steps of this channel.",
        ("Check that the right servo is on this channel, that its cable is on the spool, and that nothing blocks it."),
    ),
    Metric(
        "spring",
        "A",
        subjects.CABLES,
        ("The servo turns but nothing pulls back: the cable is wound backwards on its spool, off its spool, or cut."),
        (
            "Watch the digit while this channel closes. If it does not move, take the spool off and wind the "
            "cable in the closing direction; if it moves, a return spring is missing."
        ),
    ),
    Metric(
        "take_up",
        "mm",
        subjects.CABLES,
        "Slack cable: this much is wound in before the digit moves.",
        "Re-tension the cable at its anchor, or shift the spool on its spline, then home the hand.",
    ),
    Metric(
        "friction",
        "A",
        subjects.CABLES,
        "Friction: a stiff joint, a cable that rubs or has left a pulley, or a dry gear.",
        (
            "Unpower the hand and move each joint of the digit by hand; free the stiff one, then look along "
            "the cable's path."
        ),
    ),
    Metric(
        "resolution",
        "counts",
        subjects.CHANNELS,
        "The encoder moves in steps of several counts: its lower bits are lost.",
        "Read the servo's position on a bus adapter while its shaft is turned slowly by hand; replace the servo.",
    ),
    Metric(
        "excursion_model",
        "length",
        subjects.CHANNELS,
        "Greatest less smallest sensor value of the simulator while the channel was swept.",
    ),
    Metric(
        "rise_model_ms",
        "ms",
        subjects.CHANNELS,
        "Median 10-90 % rise of the simulator; it depends on nothing but the stream.",
    ),
    Metric("settled_samples", "samples", subjects.CHANNELS, "Samples that count for the tracking."),
    Metric("settled_percent", "% of the samples", subjects.CHANNELS, "The same, of all samples."),
    Metric("sweep_rms", "length", subjects.CHANNELS, "Tracking over the channel's own sweep only."),
    Metric("worst_residual", "length", subjects.CHANNELS, "Settled residual of greatest magnitude, with its sign."),
    Metric("worst_residual_at_s", "s", subjects.CHANNELS, "When that was."),
    Metric("worst_percent", "% of range", subjects.CHANNELS, "Its magnitude, of the range that was commanded."),
)
"""What is measured, and what it means when it is off."""
