"""Resolution of a reading: the smallest step between two readings, from window, registers and sample rate.

A limit keeps at least this distance from any healthy reading, because a closer reading cannot be distinguished. A
quantity interpolated between samples (rise time, rate, ratio) has no such step.
"""

from collections.abc import Iterable

import numpy as np

from aero.actuation import ActuationMap
from aero.channels import Channel
from aero.driver import CURRENT_A_PER_UNIT
from aero.floats import Floats
from aero.protocol import MAX_CODE
from hil.checks import EXPERIMENTS, JUDGED
from hil.checks.audit.check import NUDGE
from hil.checks.replay.check import DELAY_STEP_S
from hil.checks.shared.declaration import Bound
from hil.checks.shared.signals import MILLI
from hil.checks.staircase.check import Staircase
from hil.checks.staircase.rise_time import MATCHED_FRACTION

REGISTERS = {"A": CURRENT_A_PER_UNIT, "°C": 1.0, "of 40 steps": 1.0}
"""Resolution by unit: one digit of the servos' current or temperature register, or one step."""


def resolution(bound: Bound, firmware: Iterable[str]) -> float:
    """Return the resolution of a bound's reading in the bound's unit: the coarsest of channels and versions."""
    metric = JUDGED[bound.experiment].metric(bound.metric, bound.subjects[0])
    if metric.unit == "ms":
        return _time_ms(bound)
    if bound.metric == "take_up":  # measured as the last slack level of the staircase
        return max(_level_mm(version, bound.subjects) for version in firmware)
    if metric.unit in REGISTERS:
        return REGISTERS[metric.unit]
    return max((_count(metric.unit, version, bound.subjects) for version in firmware), default=0.0)


def _time_ms(bound: Bound) -> float:
    """Return the resolution of a time, ms: its search step, or the sample period of the readings."""
    if bound.metric == "rise_hand_ms":  # interpolated between samples, median of many steps
        return 0.0
    return MILLI * (DELAY_STEP_S if bound.metric == "replay_delay" else EXPERIMENTS[bound.experiment].period_s)


def _count(unit: str, firmware: str, subjects: tuple[str, ...]) -> float:
    """Return one servo count in `unit`, maximum over the channels; 0 for units without counts."""
    channels = [Channel[subject.upper()] for subject in subjects if subject != "hand"]
    codec = ActuationMap.for_firmware(firmware)
    part = np.ceil(MAX_CODE / codec.window.spans_counts()) / MAX_CODE  # a reading is also rounded to a whole code
    travel = part * _window_mm(codec)
    by_unit = {
        "mm": travel,
        "mrad": travel,
        "% of the window": 100.0 * part,
        "% of a nudge": 100.0 * part / NUDGE,
        # Percent of a step's change; under friction, a hand follows at least `MATCHED_FRACTION` of the step.
        "%": 100.0 * part * Staircase().levels / MATCHED_FRACTION,
    }
    return float(max(by_unit[unit][channel] for channel in channels)) if unit in by_unit else 0.0


def _level_mm(firmware: str, subjects: tuple[str, ...]) -> float:
    """Return the travel of one level of the staircase, mm, the largest of the channels."""
    travel = _window_mm(ActuationMap.for_firmware(firmware)) / Staircase().levels
    return float(max(travel[Channel[subject.upper()]] for subject in subjects))


def _window_mm(codec: ActuationMap) -> Floats:
    """Return the travel of each channel over its window, (7,), mm or mrad."""
    ends = codec.travel_from_angles(codec.angles_from_codes(np.outer([0, MAX_CODE], np.ones(len(Channel), int))))
    travel: Floats = MILLI * np.abs(np.diff(ends, axis=0))[0]
    return travel
