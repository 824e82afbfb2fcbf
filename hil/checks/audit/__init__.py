"""Channel audit: each command moves its own encoder, the right way, by the right amount, and no other.

The expected signs come from the mechanism (`closing_current`) and never from the map under test. Leaves `codes`,
`command_codes`, `currents` and `temperatures`.
"""

from __future__ import annotations

import numpy as np

from aero.actuation.fingerprint import fits_span
from aero.channels import Channel
from aero.protocol import MAX_CODE
from hil.checks.shared import subjects
from hil.checks.shared.closing_current import closing_current
from hil.checks.shared.command_steps import find_steps
from hil.checks.shared.experiment import Driver, Experiment, Measured, Metric, map_of, one_closed
from hil.checks.shared.signals import at_times
from hil.recordings.recorder import Progress, Recorder
from hil.recordings.recording import Recording
from hil.targets.target import Target

NUDGE = 0.2
HALF_S = 0.6
"""Time at the nudge, and at the open hand after it, s."""


def run(target: Target, recorder: Recorder, progress: Progress) -> None:
    """Nudge each channel closed and open again."""
    recorder.begin({"nudge": NUDGE, "half_s": HALF_S})
    driver = Driver(target, recorder, progress, HALF_S * (1 + 2 * len(Channel)))
    driver.hold(np.zeros(len(Channel)), HALF_S, "open hand")
    for channel in Channel:
        driver.hold(one_closed(channel, NUDGE), HALF_S, channel.label)
        driver.hold(np.zeros(len(Channel)), HALF_S, channel.label)


def measure(recording: Recording) -> Measured:
    """Return, in per cent of the nudge, how far each channel followed, came back, and moved with the others."""
    codes, commands, currents = (recording[name] for name in ("codes", "command_codes", "currents"))
    pull = at_times(currents.times, closing_current(currents.values, recording.header.hand), codes.times)
    spans = map_of(recording.header).window.spans_counts()
    found: dict[str, dict[str, float]] = {}
    closing = [step for step in find_steps(commands.times, commands.values) if step.after > step.before]
    for step in closing:
        start, nudged = _row(codes.times, step.start), _row(codes.times, step.end)
        moved = (codes.values[nudged] - codes.values[start]) / (NUDGE * MAX_CODE) * 100.0
        others = np.delete(moved, step.channel)
        back = codes.values[_row(codes.times, step.end + HALF_S), step.channel]
        found[Channel(step.channel).label] = {
            "followed": float(moved[step.channel]),
            "others_moved": float(np.abs(others).max()),
            "came_back": 100.0 - float(back - codes.values[start, step.channel]) / (NUDGE * MAX_CODE) * 100.0,
            "pull": float(pull[nudged, step.channel] - pull[start, step.channel]),
            "quantum_fits": 100.0 * float(fits_span(codes.values[:, step.channel], spans[step.channel]).mean()),
        }
    return found


def _row(times: np.ndarray[tuple[int], np.dtype[np.float64]], t: float) -> int:
    """Return the last sample taken before a command at `t`."""
    return int(np.searchsorted(times, t)) - 1


METRICS = (
    Metric(
        "followed",
        "% of a nudge",
        subjects.CHANNELS,
        (
            "The channel does not go where it is told: blocked at once, reversed (a linkage or horn mounted "
            "the wrong way round turns against its stop), or another servo answers for it."
        ),
        (
            "Watch which digit moves when this channel alone is nudged, and which way. The wrong digit: "
            "exchange the servos' IDs. Against its stop: remount the horn."
        ),
    ),
    Metric(
        "others_moved",
        "% of a nudge",
        subjects.CHANNELS,
        "Another encoder moves along: two servos share an ID, or the channel order is mixed up.",
        (
            "Compare the order in use with the driver's: index, middle, ring, pinky, thumb abduction, CMC "
            "flexion, flexor."
        ),
    ),
    Metric(
        "came_back",
        "% of a nudge",
        subjects.CHANNELS,
        "The channel does not open again.",
        "Look for friction in the digit and for a return spring that has come off.",
    ),
    Metric(
        "quantum_fits",
        "% of readings",
        subjects.CHANNELS,
        (
            "The command window is not the firmware's: the servo is trimmed, or firmware 0.2.0 restarted "
            "without homing and forgot half of its thumb shift."
        ),
        "Home the hand, which drops trims and restores the window.",
    ),
    Metric(
        "pull",
        "A",
        subjects.CHANNELS,
        "The nudge does not load the servo as on a good hand: nothing pulls back, or too much holds it.",
        "Move the digit by hand with the power off; look for a loose cable, a missing spring or a stiff joint.",
    ),
)
"""What is measured, and what it means when it is off."""

EXPERIMENT = Experiment(
    "audit",
    "Each command moves its own encoder, the right way",
    run,
    measure,
    (NUDGE,) * 7,
    METRICS,
    rank=20,
    gentle=True,
)
