"""Synthetic recordings with known results."""

import math
from dataclasses import replace

import numpy as np

from aero.channels import Channel
from hil.recordings.recording import Header, Recording, Series

LABELS = tuple(channel.label for channel in Channel)
UNITS = tuple("rad" if channel is Channel.THUMB_ABDUCTION else "m" for channel in Channel)
HEADER = Header("staircase", "emulated", "right", "0.2.0", "paper", "homed", "reference", 0)
HOLD = 0.48
RANGES = np.array([0.046, 0.046, 0.046, 0.046, 1.75, 0.011, 0.027])


def staircase(*, levels=4, tau=0.03, gain=1.0, offset=0.0, hand_tau=0.05, dt=0.01):
    """Return a one-channel-at-a-time staircase from zero with the response of two first-order lags."""
    per = round(HOLD / dt)
    fractions = [*range(1, levels + 1), *range(levels - 1, -1, -1)]
    levels_of = np.zeros((7 * 2 * levels + 1, 7))
    for channel in range(7):
        for i, fraction in enumerate(fractions):
            levels_of[1 + channel * 2 * levels + i, channel] = fraction / levels * RANGES[channel]
    command = np.repeat(levels_of, per, axis=0)
    t = dt * np.arange(len(command))

    def lag(tau):
        value, out = np.zeros(7), []
        for row in command:
            out.append(value)
            value = row + (value - row) * math.exp(-dt / tau)
        return np.array(out)

    hand = lag(hand_tau)
    series = {"command": command, "model": lag(tau), "hand": gain * hand + offset * RANGES, "travel": hand}
    series["goal"] = command
    recorded = {name: Series.of(LABELS, UNITS, t, v) for name, v in series.items()}
    recorded["codes"] = Series.of(LABELS, ["u16"] * 7, t, np.zeros_like(command))
    recorded["command_codes"] = Series.of(LABELS, ["u16"] * 7, t, np.round(65535 * command / RANGES))
    # Springs that pull with 0.7 A at full closure.
    pull = 0.7 * command / RANGES
    recorded["currents"] = Series.of(LABELS, ["A"] * 7, t, pull * [1, 1, 1, 1, 1, 1, -1])
    return Recording(HEADER, recorded)


def replaced(recording, name, values):
    """Return the recording with other values in one series."""
    series = recording[name]
    changed = Series.of(series.columns, series.units, series.times, values)
    return Recording(recording.header, {**recording.series, name: changed}, recording.wire, recording.events)


def held(experiment, postures, hold_s, *, answer=None, currents=None, temperatures=None, dt=0.01, **parameters):
    """Return the codes of postures (n, 7), each for `hold_s`; the hand is at `answer` (n, 7), by default the commands.

    The hand arrives a sample after the command, because each sample reads before it commands.
    """
    per = round(hold_s / dt)
    command = np.repeat(np.asarray(postures, float), per, axis=0)
    reached = command if answer is None else np.repeat(np.asarray(answer, float), per, axis=0)
    t = dt * np.arange(len(command))
    readings = {
        "command_codes": ("u16", command),
        "codes": ("u16", np.vstack([reached[:1], reached[:-1]])),
        "currents": ("A", np.zeros_like(command) if currents is None else currents),
        "temperatures": ("degC", np.full_like(command, 30.0) if temperatures is None else temperatures),
    }
    series = {name: Series.of(LABELS, [unit] * 7, t, values) for name, (unit, values) in readings.items()}
    return Recording(replace(HEADER, experiment=experiment, parameters=parameters), series)
