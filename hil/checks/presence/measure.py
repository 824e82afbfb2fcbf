"""Temperatures, idle currents, and how completely and freshly the hand answers."""

from __future__ import annotations

import numpy as np

from aero.channels import Channel
from hil.checks.shared.exchanges import exchanges, lost_replies, round_trips
from hil.checks.shared.experiment import Measured
from hil.recordings.recording import Header, Recording
from hil.targets.boot_text import identify


def measure(recording: Recording) -> Measured:
    """Return temperatures and idle currents by channel; lost replies, round trip and freshness of the hand."""
    currents, temperatures = recording["currents"].values, recording["temperatures"].values
    channels = {
        channel.label: {
            "temperature": float(temperatures[:, channel].max()),
            "idle_current": float(np.abs(np.median(currents[:, channel]))),
        }
        for channel in Channel
    }
    requests, trips = round_trips(recording.wire)
    return channels | {
        "hand": {
            "lost_replies": 100.0 * lost_replies(exchanges(recording.wire)) / requests,
            "round_trip": 1e3 * float(np.median(trips)),
            "distinct_readings": float(len(np.unique(currents, axis=0))),
            "boot_contradictions": float(_contradictions(recording.header)),
        }
    }


def _contradictions(header: Header) -> int:
    """Return how many things the boot text, if there was one, says against the header."""
    text = str(header.parameters["boot_text"])
    if not text:
        return 0
    board = identify(text)
    return (header.firmware not in board.versions) + (board.side not in (None, header.hand)) + len(board.silent)
