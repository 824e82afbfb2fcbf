"""The measurements a servo reports: registers 56 to 70, from the state of its shaft."""

from __future__ import annotations

import math
from random import Random
from struct import Struct

from firmware_emulator.servo.control import OFF, PWM, Settings
from firmware_emulator.servo.electrical import static_current
from firmware_emulator.servo.frame import Frame, Mounting
from firmware_emulator.servo.memory import RegisterFile
from firmware_emulator.servo.parameters import SPEED_UNIT_COUNTS, ServoParameters
from firmware_emulator.servo.registers import FEEDBACK
from firmware_emulator.servo.shafts import Sample

BLOCK = Struct("<HHHBBBBBHH")
MULTI_TURN = 0x10
"""Bit of the phase register: the reading counts turns."""
MAX_UNITS = 2047
"""What the current register can hold."""
REACHED_COUNTS = 30
"""Error up to which the goal counts as reached, counts (assumption)."""


class FeedbackBlock:
    """Keeps a servo's measurement registers up to date; one refresh a tick, however often they are read."""

    def __init__(
        self, memory: RegisterFile, frame: Frame, mounting: Mounting, parameters: ServoParameters, noise: Random
    ) -> None:
        self._memory = memory
        self._frame = frame
        self._shaft = mounting.shaft
        self._direction = mounting.direction
        self._parameters = parameters
        self._noise = noise
        self._seen: Sample | None = None
        self._measured_at = 0.0
        self._measured_units = 0.0
        self.status = 0
        self.temperature_c = parameters.start_temperature_c
        self.current_units = 0

    def invalidate(self) -> None:
        """Write the registers at the next refresh even if the shaft has not been sampled anew."""
        self._seen = None

    def refresh(self, sample: Sample, settings: Settings, setpoint_counts: float) -> None:
        """Write the registers from a sample of the shafts, unless it is the one they show already."""
        if sample is self._seen:
            return
        self._seen = sample
        servo = self._parameters
        counts = self._frame.counts(sample.angles[self._shaft])
        if not self._memory.bytes[18] & MULTI_TURN:
            counts %= 4096
        speed = round(self._frame.counts_per_rad * sample.speeds[self._shaft] / SPEED_UNIT_COUNTS)
        # The sign of load and current is that of a goal torque: positive toward lower counts.
        effort = -self._direction * sample.efforts[self._shaft]
        load = round(1000.0 * effort / servo.stall_torque)
        back_emf = -self._direction * servo.back_emf * sample.speeds[self._shaft]
        self.current_units = current = self._current(effort - back_emf, sample.time, settings)
        moving = bool(speed) | (abs(setpoint_counts - counts) > REACHED_COUNTS) << 1
        BLOCK.pack_into(
            self._memory.bytes,
            FEEDBACK,
            _word(counts),
            _word(speed),
            load if load >= 0 else -load | 0x400,
            round(10.0 * servo.voltage),
            int(self.temperature_c),
            self._memory.bytes[64],
            self.status,
            moving,
            _word(round(setpoint_counts)),
            current if current >= 0 else -current | 0x8000,
        )

    def _current(self, winding: float, now: float, settings: Settings) -> int:
        """Reading (register units) for what drives the winding, N m."""
        servo = self._parameters
        units = 0.0 if settings.enable == OFF else math.copysign(static_current(winding, servo), winding)
        # The loop clips what it drives; a blocked servo comes to read its goal torque exactly, as homing needs.
        limit = settings.current if settings.mode != PWM else MAX_UNITS
        units = min(max(units, -limit), limit)
        share = math.exp((self._measured_at - now) / servo.current_filter_s)
        self._measured_at = now
        self._measured_units = units + share * (self._measured_units - units)
        noisy = round(self._measured_units + self._noise.gauss(0.0, servo.current_noise_units))
        return min(max(noisy, -limit), limit)


def _word(value: int) -> int:
    """Sign-magnitude word of a measurement; readings beyond 15 bits stay at the end of the range."""
    return min(value, 0x7FFF) if value >= 0 else min(-value, 0x7FFF) | 0x8000
