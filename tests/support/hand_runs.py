"""Runs of one hand with chosen readings of the ring finger's rise time, without recordings."""

from datetime import UTC, datetime, timedelta
from pathlib import Path

from hil.history.drift import tracks_of
from hil.history.runs import HandRun, RunVerdict
from hil.recordings.recording import Header

BEGIN = datetime(2026, 1, 1, tzinfo=UTC)
HEADER = Header("staircase", "/dev/ttyACM0", "right", "0.2.0", "identified", "released", "physical", 0)
RING = "ring"


def runs(values, *, every_days=7.0, interventions=None):
    """Runs with one reading each: the ring finger's rise time, ms."""
    return [
        HandRun(
            Path(f"run-{place}"),
            BEGIN + timedelta(days=every_days * place),
            HEADER,
            {"staircase": {RING: {"rise_hand_ms": float(value)}}},
            verdict=RunVerdict.WITHIN,
            interventions=(interventions or {}).get(place, ()),
        )
        for place, value in enumerate(values)
    ]


def limit_of():
    (track,) = tracks_of(runs([50.0]))
    return track.limit


LIMIT = limit_of()
MIDDLE, HALF = (LIMIT.at_least + LIMIT.at_most) / 2.0, (LIMIT.at_most - LIMIT.at_least) / 2.0
