"""Measurement registers 56 to 70 of a servo, computed from the state of its shaft.

Refreshed for all seven servos at 100 Hz, so constants are precomputed.
"""

from collections.abc import Iterator
from math import cos, exp, floor, log, sin, sqrt, tau
from random import Random
from struct import Struct

from firmware_emulator.servo.control import OFF, PWM, LoopSettings
from firmware_emulator.servo.electrical import CurrentLaw
from firmware_emulator.servo.frame import Frame, Mounting
from firmware_emulator.servo.memory import RegisterFile
from firmware_emulator.servo.model_file import FEEDBACK
from firmware_emulator.servo.parameters import RAD_PER_COUNT, ServoParameters
from firmware_emulator.servo.shafts import Sample

BLOCK = "HHHBBBBBHH"
"""Struct format of registers 56 to 70."""
WITHOUT_CURRENT = 4
"""Bytes missing from the block of a servo without current measurement."""
MULTI_TURN = 0x10
"""Bit of the phase register for a multi-turn position reading."""
MAX_WORD = 0x7FFF
"""Largest magnitude of a sign-magnitude word."""
MAX_UNITS = 2047
"""Largest value of the current register."""
REACHED_COUNTS = 30
"""Threshold of the position error, counts; up to it the goal counts as reached (assumption)."""


class FeedbackBlock:
    """Measurement registers of a servo, refreshed at most once per tick."""

    def __init__(
        self, memory: RegisterFile, frame: Frame, mounting: Mounting, parameters: ServoParameters, noise: Random
    ) -> None:
        model = memory.model
        self._memory = memory.bytes
        block = Struct("<>"[model.byte_order == "big"] + BLOCK)
        self._pack = block.pack
        self._size = block.size if model.has("present_current") else block.size - WITHOUT_CURRENT
        self._span = slice(FEEDBACK, FEEDBACK + self._size)
        self._phase, self._async_flag = model.places["phase"].address, model.places["async_flag"].address
        self._turn, self._last = (model.resolution, 0) if model.wraps else (0, model.resolution - 1)
        self._moving_bits = model.places["moving"].high
        self._frame = frame
        self._shaft = mounting.shaft
        self._turning = CurrentLaw(parameters).turning
        self._filter_s = parameters.current_filter_s
        self._noise = standard_normal(noise).__next__
        self._noise_units = parameters.current_noise_units
        # Load and current have the sign of a goal torque: positive toward lower counts.
        self._sign = -mounting.direction
        self._speed_units = frame.counts_per_rad / model.speed_unit_counts
        # Motor counts are 4096 per turn for every encoder resolution.
        self._motor_counts_per_rad = mounting.direction / RAD_PER_COUNT
        self._load_units = 1000.0 / parameters.stall_torque
        self._back_emf = self._sign * parameters.back_emf
        self.volts = parameters.voltage
        """Supply voltage at this servo, V."""
        self._settings: LoopSettings | None = None
        self._limit = 0
        self._seen: Sample | None = None
        self._measured_at = 0.0
        self._measured_units = 0.0
        self.status = 0
        self.temperature_c = parameters.start_temperature_c
        self.current_units = 0

    def invalidate(self) -> None:
        """Force the next refresh to write the registers, even without a new sample."""
        self._seen = None

    def refresh(self, sample: Sample, settings: LoopSettings, setpoint_counts: float) -> None:
        """Write the registers from a sample of the shafts; skip a sample already written."""
        if sample is self._seen:
            return
        self._seen = sample
        now, angles, speeds, efforts = sample
        shaft, memory = self._shaft, self._memory
        shaft_speed = speeds[shaft]
        frame = self._frame
        counts = floor(frame.rounding_zero + frame.counts_per_rad * angles[shaft])
        if not self._turn:
            counts = min(max(counts, 0), self._last)
        elif not memory[self._phase] & MULTI_TURN:
            counts %= self._turn
        speed = round(self._speed_units * shaft_speed)
        effort = self._sign * efforts[shaft]
        load = round(self._load_units * effort)
        self.current_units = current = self._current(
            effort - self._back_emf * shaft_speed, self._motor_counts_per_rad * shaft_speed, now, settings
        )
        target = round(setpoint_counts)
        away = setpoint_counts - counts
        moving = (1 if speed else 0) | (0 if -REACHED_COUNTS <= away <= REACHED_COUNTS else 2)
        warm = int(self.temperature_c)
        block = self._pack(
            counts if 0 <= counts <= MAX_WORD else _word(counts),
            speed if 0 <= speed <= MAX_WORD else _word(speed),
            load if load >= 0 else -load | 0x400,
            round(10.0 * self.volts),
            warm if warm < 255 else 255,  # clipped to one byte
            memory[self._async_flag],
            self.status,
            self._moving_bits & moving,
            target if 0 <= target <= MAX_WORD else _word(target),
            current if current >= 0 else -current | 0x8000,
        )
        memory[self._span] = block[: self._size]

    def _current(self, winding: float, speed: float, now: float, settings: LoopSettings) -> int:
        """Return the current reading (register units) for a winding effort (N m) and a speed (counts/s)."""
        if settings is not self._settings:
            self._settings = settings
            self._limit = MAX_UNITS if settings.mode == PWM else settings.current
        # The loop clips the current, so a blocked servo reads exactly its goal torque, as homing requires.
        limit = self._limit
        units = 0.0
        if settings.enable != OFF:
            units = self._turning(winding, speed)
            units = min(units, limit)
            if winding < 0.0:
                units = -units
        share = exp((self._measured_at - now) / self._filter_s)
        self._measured_at = now
        self._measured_units = measured = units + share * (self._measured_units - units)
        noisy = round(measured + self._noise() * self._noise_units)
        return noisy if -limit <= noisy <= limit else limit if noisy > 0 else -limit


def standard_normal(random: Random) -> Iterator[float]:
    """Yield the sequence of `random.gauss(0.0, 1.0)` at half its cost."""
    uniform = random.random
    while True:
        angle = uniform() * tau
        radius = sqrt(-2.0 * log(1.0 - uniform()))
        yield cos(angle) * radius
        yield sin(angle) * radius


def _word(value: int) -> int:
    """Return the sign-magnitude word of a measurement, saturated at 15 bits."""
    return min(value, MAX_WORD) if value >= 0 else min(-value, MAX_WORD) | 0x8000
