"""Expected frames of a policy, recomputed from its readings with a packing independent of the driver."""

import struct

import numpy as np
from policies import actions_on

COMMAND_TO_WIRE = [4, 5, 6, 0, 1, 2, 3]
"""Wire order: thumb abduction, CMC flexion, flexor, index, middle, ring, pinky."""
SET_POSITIONS = b"\x11"
SHAFT_RAD_S = 12.9
"""Limit of a commanded shaft speed in the loop, rad/s (740 °/s)."""


def frame(codes):
    """Return the sixteen bytes that send codes (7,) in command order."""
    return struct.pack("<cB7H", SET_POSITIONS, 0, *np.asarray(codes, int)[COMMAND_TO_WIRE].tolist())


def positions_sent(wire):
    """Return the codes, (n, 7) in command order, and times, (n,) s, of all position frames to the hand."""
    frames = [record for record in wire if record.direction == "to_hand" and record.data[:1] == SET_POSITIONS]
    words = np.array([struct.unpack_from("<7H", record.data, 2) for record in frames]).reshape(-1, 7)
    codes = np.empty_like(words)
    codes[:, COMMAND_TO_WIRE] = words
    return codes, np.array([record.t for record in frames])


def asked(codec, lengths):
    """Return the codes of lengths (7,) by a map, clipped to its window."""
    angles = codec.angles_from_travel(codec.travel_from_lengths(np.asarray(lengths)))
    return codec.saturating_codes(angles).codes.astype(float)


def fastest(codec, period_s):
    """Return the largest change of a command in one period, (7,) codes."""
    window = codec.window_rad
    return SHAFT_RAD_S * period_s * 65535 / (window[:, 1] - window[:, 0])


def frames_again(policy, codec, codes, correction, currents=None):
    """Return the frames of `policy` for the sequence of readings `codes` (n, 7), from its nominal grasp.

    Args:
        policy: what acts.
        codec: the hand's actuation map.
        codes: as the hand reported them, command order.
        correction: (7,) m, abduction rad, as in `RunSettings`.
        currents: (n, 7) A, for a policy that observes them.
    """
    settings = policy.settings
    nominal = np.array(settings.nominal)
    most, command, frames = fastest(codec, settings.period_s), asked(codec, nominal + correction), []
    lengths = np.array([codec.lengths_from_codes(row.astype(np.uint16)) for row in codes]) - correction
    for action in actions_on(policy, lengths, currents):
        target = policy.interface.action.target(action, codec)
        command = command + np.clip(asked(codec, target + correction) - command, -most, most)
        frames.append(frame(np.round(command)))
    return frames
