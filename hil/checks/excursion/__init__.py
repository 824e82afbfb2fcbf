"""Excursion: how far each channel goes alone, how hard it is stopped, and the whole hand from open to fist.

The full code range is commanded, whatever the map says, so the end stops show where the command window really lies.
The paper's kinematic validation: the fist of the hand less that of the simulator under the same commands.
Leaves `codes`, `command_codes`, `currents` and `temperatures`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aero.channels import Channel
from aero.protocol import MAX_CODE
from hil.checks.shared import subjects
from hil.checks.shared.closing_current import closing_current
from hil.checks.shared.command_steps import find_steps
from hil.checks.shared.experiment import (
    Driver,
    Experiment,
    Measured,
    Metric,
    last_before,
    map_of,
    one_closed,
)
from hil.checks.shared.signals import display_unit
from hil.checks.shared.simulated_fist import FIST, simulated_fist
from hil.recordings.recorder import LENGTH_UNITS, Progress, Recorder
from hil.recordings.recording import Recording
from hil.targets.target import Target

Floats = NDArray[np.float64]

MOVING = 0.02
"""Part of the window from one reading to the next from which a channel moves."""
REFRESHED_S = 0.015
"""Time in which every firmware but `pre` has refreshed its readings, s."""
HOLD_S = 0.9
"""Time at either end, s: a finger of firmware `pre` needs 0.7 s for its range."""


def run(target: Target, recorder: Recorder, progress: Progress) -> None:
    """Close and open each channel alone, then close all to a fist."""
    recorder.begin({"hold_s": HOLD_S})
    driver = Driver(target, recorder, progress, HOLD_S * (2 + len(FIST) + 2 * len(Channel)))
    opened = np.zeros(len(Channel))
    driver.hold(opened, HOLD_S, "open hand")
    for channel in Channel:
        driver.hold(one_closed(channel, 1.0), HOLD_S, channel.label)
        driver.hold(opened, HOLD_S, channel.label)
    for codes in FIST:
        driver.hold(codes, HOLD_S, "fist")
    driver.hold(opened, HOLD_S, "open hand")


def measure(recording: Recording) -> Measured:
    """Return where each channel stops alone and in the fist, under which current, and how many readings are stale.

    The fist is measured beside the simulator's.
    """
    codes, commands, currents = (recording[name] for name in ("codes", "command_codes", "currents"))
    codec = map_of(recording.header)
    pull = closing_current(currents.values, recording.header.hand)
    steps = find_steps(commands.times, commands.values)
    fist = [step for step in steps[2 * len(Channel) :] if step.after > step.before]
    ends = np.array([last_before(codes.times, codes.values, t) for t in (fist[0].start, fist[-1].end)])
    fist_travel = np.diff(codec.travel_from_angles(codec.angles_from_codes(ends.astype(np.int64))), axis=0)[0]
    header = recording.header
    model_travel = simulated_fist(header.firmware, header.window, header.hand)
    found: dict[str, dict[str, float]] = {}
    for step in steps[: 2 * len(Channel) : 2]:
        closed = last_before(codes.times, codes.values, step.end).astype(int)
        _, scale = display_unit(LENGTH_UNITS[step.channel])
        found[Channel(step.channel).label] = {
            "closed_percent": 100.0 * float(closed[step.channel]) / MAX_CODE,
            "closed_angle": float(np.rad2deg(codec.angles_from_codes(closed)[step.channel])),
            "stop_current": float(last_before(currents.times, pull, step.end)[step.channel]),
            "fist_travel": scale * float(fist_travel[step.channel]),
            "fist_travel_model": scale * float(model_travel[step.channel]),
            "fist_difference": scale * abs(float(model_travel[step.channel] - fist_travel[step.channel])),
        }
    return found | {"hand": {"stale_readings": 100.0 * stale(codes.times, codes.values)}}


def stale(times: Floats, codes: Floats) -> float:
    """Return the share of readings that repeat the one before although the channel moved before and after it.

    Args:
        times: (n,) float, s; readings closer than `REFRESHED_S` may repeat and do not count.
        codes: (n, 7) float, readings.
    """
    steps = np.abs(np.diff(codes, axis=0)) / MAX_CODE
    before, now, after = steps[:-2], steps[1:-1], steps[2:]
    apart = (np.diff(times)[1:-1] > REFRESHED_S)[:, None]
    on_its_way = (before > MOVING) & (after > MOVING) & apart
    repeated = on_its_way & (now == 0)
    return float(repeated.sum() / on_its_way.sum()) if on_its_way.any() else np.nan


METRICS = (
    Metric(
        "closed_percent",
        "% of the window",
        subjects.FINGERS,
        (
            "Too little: the finger is blocked, or its cables are swapped with another channel's. Too much: "
            "it never met its end stop, so its cable is slack or pulls nothing."
        ),
        "Watch the finger close. Compare with its neighbours.",
        end_of_scale=100.0,
    ),
    Metric(
        "closed_percent",
        "% of the window",
        ("thumb_cmc_flexion",),
        (
            "CMC flexion stops in the wrong place. At 100 %: nothing stops it, as when its cable and the "
            "flexor's are swapped."
        ),
        (
            "Watch the thumb while this channel alone closes: it must swing over the palm, not curl. If it "
            "curls, swap the two cables back."
        ),
        end_of_scale=100.0,
    ),
    Metric(
        "closed_percent",
        "% of the window",
        ("thumb_flexor",),
        (
            "The flexor stops in the wrong place. At about a third: it drives CMC flexion, so the two cables "
            "are swapped."
        ),
        (
            "Watch the thumb while this channel alone closes: it must curl, not swing over the palm. If it "
            "swings, swap the two cables back."
        ),
        end_of_scale=100.0,
    ),
    Metric(
        "stale_readings",
        "% of readings on the way",
        subjects.HAND,
        "Readings repeat although the channel moves: old replies are taken for new ones, or telemetry stands still.",
        "Look for a hub, a network or another program between driver and hand, then for a servo that is silent.",
    ),
    Metric(
        "stop_current",
        "A",
        subjects.CHANNELS,
        "The channel is held with another current where it stops: its stop lies elsewhere, or its servo is weak.",
        "Home the hand, then validate again; if it stays, compare the servo with its neighbours on a bus adapter.",
    ),
    *(
        Metric(
            "fist_travel",
            unit,
            channels,
            "In the fist the channel travels another way than alone: digits meet, or the supply sags.",
            "Watch the hand close; measure the supply while it does.",
        )
        for unit, channels in (("mm", subjects.CABLES), ("mrad", ("thumb_abduction",)))
    ),
    Metric(
        "closed_percent",
        "% of the window",
        ("thumb_abduction",),
        "The abduction does not reach the end of its window.",
        "Look for what the thumb meets; check the linkage screw.",
    ),
    Metric(
        "closed_angle",
        "deg",
        ("thumb_cmc_flexion",),
        (
            "The palm stops CMC flexion where another command window would put it: the map is for the wrong firmware "
            "window. A board of another version, or 0.2.0 in another state, moves it by 9.93 degrees."
        ),
        (
            "Home the hand, or power-cycle it. Then check which firmware is on the board, and name it. Name the "
            "calibration that the hand has if it must not be homed."
        ),
    ),
    Metric(
        "closed_angle",
        "deg",
        tuple(channel for channel in subjects.CHANNELS if channel != "thumb_cmc_flexion"),
        "Shaft angle where the channel stops.",
    ),
    *(
        Metric(name, unit, channels, meaning)
        for unit, channels in (("mm", subjects.CABLES), ("mrad", ("thumb_abduction",)))
        for name, meaning in (
            ("fist_travel_model", "Travel of the simulator's channel from open to the fist, under the same commands."),
            ("fist_difference", "Magnitude of simulator less hand, from open to the fist: the paper's excursion |Δ|."),
        )
    ),
)
"""What is measured, and what it means when it is off."""

EXPERIMENT = Experiment(
    "excursion",
    "How far each channel goes, and what stops it",
    run,
    measure,
    (1.0,) * 7,
    METRICS,
    rank=30,
    pushes_at_stops=True,
)
