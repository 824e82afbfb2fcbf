"""Resolution of a reading: the smallest step between two readings, from window, registers and sample rate.

A limit keeps at least this distance from any healthy reading, because a closer reading cannot be distinguished. A
quantity interpolated between samples (rise time, rate, ratio) has no such step, by `RESOLUTION` of its check.
"""

from collections.abc import Iterable

import numpy as np

from aero.actuation import ActuationMap
from aero.channels import Channel
from aero.driver import CURRENT_A_PER_UNIT
from aero.protocol import MAX_CODE
from hil.checks import EXPERIMENTS, JUDGED
from hil.checks.audit.check import NUDGE
from hil.checks.shared.declaration import Bound
from hil.checks.shared.experiment import window_mm
from hil.checks.shared.signals import MILLI
from hil.checks.staircase.check import Staircase
from hil.checks.staircase.rise_time import MATCHED_FRACTION

REGISTERS = {"A": CURRENT_A_PER_UNIT, "°C": 1.0, "of 40 steps": 1.0}
"""Resolution by unit: one digit of the servos' current or temperature register, or one step."""


def resolution(bound: Bound, firmware: Iterable[str]) -> float:
    """Return the resolution of a bound's reading in the bound's unit: the coarsest of channels and versions."""
    measuring = JUDGED[bound.experiment]
    unit = measuring.metric(bound.metric, bound.subjects[0]).unit
    if (step := measuring.resolution.get(bound.metric)) is not None:
        return max(step(version, bound.subjects) for version in firmware)
    if unit == "ms":
        return MILLI * EXPERIMENTS[bound.experiment].period_s
    if unit in REGISTERS:
        return REGISTERS[unit]
    return max((_count(unit, version, bound.subjects) for version in firmware), default=0.0)


def _count(unit: str, firmware: str, subjects: tuple[str, ...]) -> float:
    """Return one servo count in `unit`, maximum over the channels; 0 for units without counts."""
    channels = [Channel[subject.upper()] for subject in subjects if subject != "hand"]
    codec = ActuationMap.for_firmware(firmware)
    part = np.ceil(MAX_CODE / codec.window.spans_counts()) / MAX_CODE  # a reading is also rounded to a whole code
    travel = part * window_mm(codec)
    by_unit = {
        "mm": travel,
        "mrad": travel,
        "% of the window": 100.0 * part,
        "% of a nudge": 100.0 * part / NUDGE,
        # Percent of a step's change; under friction, a hand follows at least `MATCHED_FRACTION` of the step.
        "%": 100.0 * part * Staircase().levels / MATCHED_FRACTION,
    }
    return float(max(by_unit[unit][channel] for channel in channels)) if unit in by_unit else 0.0
