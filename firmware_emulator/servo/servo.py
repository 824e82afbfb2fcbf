"""Bus servo: a register file that drives a shaft.

State machine: control registers change at the end of a bus write and take effect `goal_delay_s` later, except torque
off, which takes effect on the next tick. The effect is a new drive of the plant and, if acceleration or speed limit the
motion, a trapezoidal setpoint. Rewriting an equal goal has no effect, so homing, which rewrites its goal hundreds of
times a second, does not restart the ramp.
"""

from random import Random
from typing import Self

from firmware_emulator.kernel import Kernel
from firmware_emulator.servo import control
from firmware_emulator.servo.control import LoopSettings
from firmware_emulator.servo.electrical import Warmth
from firmware_emulator.servo.feedback import MULTI_TURN, FeedbackBlock
from firmware_emulator.servo.frame import Frame, Mounting
from firmware_emulator.servo.memory import RegisterFile, decode_signed
from firmware_emulator.servo.model_file import FEEDBACK
from firmware_emulator.servo.models import model_of
from firmware_emulator.servo.parameters import COUNTS_PER_TURN, CURRENT_UNIT_MA, ServoParameters
from firmware_emulator.servo.profile import Trapezoid, plan
from firmware_emulator.servo.protection import OVERLOAD, TEMPERATURE, Protection
from firmware_emulator.servo.shafts import Shafts

MIDDLE = 128
"""Value of an STS servo's torque register that triggers a calibration and is not stored."""
MID_COUNTS = 2048
NO_ID = -1
"""Placeholder for no ID."""


class Servo:
    """Servo on a shaft of a plant."""

    def __init__(
        self,
        servo: int,
        mounting: Mounting,
        parameters: ServoParameters,
        kernel: Kernel,
        shafts: Shafts,
        *,
        seed: int,
    ) -> None:
        """Mount a servo with the ID `servo`, powered and with torque off."""
        self.model = model_of(parameters.model)
        self.memory = RegisterFile(servo, self.model)
        self.frame = Frame(mounting, self.model.counts_per_turn, wraps=self.model.wraps)
        self.parameters = parameters
        self.silent_until = -1.0
        model = self.model
        # Writes to these addresses enable the torque; the firmware never enables it explicitly (assumption).
        self._goal = model.span("goal_position", "goal_speed")
        # Start of a whole-goal write; an immediate repetition of such a write has no effect.
        self._goal_block = model.places["acceleration"].address
        goal = range(self._goal_block, self._goal.stop)
        whole = all(at in model.register_at and model.register_at[at].name in control.GOAL for at in goal)
        self._goal_size = len(goal) if whole else 0
        """Length of a whole goal, bytes; 0 if other registers interrupt the goal registers."""
        self._control = model.span(*control.LOOP)
        self._offset = model.span("offset")
        self._torque = model.places["torque_enable"].address
        self._fastest = parameters.no_load_speed_counts * model.counts_per_turn / COUNTS_PER_TURN
        self._acceleration_unit = parameters.acceleration_unit_counts * model.counts_per_turn / COUNTS_PER_TURN
        self._mounting = mounting
        self._kernel = kernel
        self._shafts = shafts
        self.feedback = FeedbackBlock(self.memory, self.frame, mounting, parameters, Random(f"{seed}/{servo}"))
        self._heat = Warmth(parameters.start_temperature_c)
        self._wanted = self._acting = self._at_power_up()
        self._asked: LoopSettings | None = None
        """Settings in the control registers; None after a write other than a goal."""
        self._epoch = 0
        self._motion: Trapezoid | None = None
        self._setpoint_counts = 0.0
        self._last_goal: tuple[int, bytes] | None = None
        self._protection = Protection(self.model)
        self._held: tuple[int, bytes] | None = None
        self._enable_when_cool = control.OFF
        """Torque register to restore once a cut-out servo has cooled."""
        self._take_address()

    @property
    def status(self) -> int:
        """Error byte of the answers."""
        return self.feedback.status

    @property
    def response_level(self) -> int:
        """Response level; at 0 only pings and reads are answered."""
        return self.memory.get("response_level")

    def read(self, address: int, count: int) -> bytes:
        """Return `count` bytes from `address`, with the measurements of the last tick."""
        if address + count > FEEDBACK:
            self.feedback.refresh(self._shafts.sample(), self._acting, self._setpoint_counts)
        return self.memory.read(address, count)

    def write(self, address: int, data: bytes) -> None:
        """Apply a write from the bus."""
        write = address, data
        if write == self._last_goal:
            return
        known, self._asked = self._asked, None
        self._last_goal = write if address == self._goal_block else None
        if known and known.enable == control.ON and address == self._goal_block and len(data) == self._goal_size:
            self.memory.write(address, data)
            self._control_written(known.with_goal_of(self.memory))
            return
        at = self._torque - address
        if self.model.middle_by_torque and 0 <= at < len(data) and data[at] == MIDDLE:
            self.calibrate(None)
            data = data[:at] + bytes((self.memory.get("torque_enable"),)) + data[at + 1 :]
        self.memory.write(address, data)
        written = range(address, address + len(data))
        if _meet(written, self._goal):
            self.memory.set("torque_enable", control.ON)
        if self._protection.hot and (self._torque in written or _meet(written, self._goal)):
            self._wait_until_cool()
        if _meet(written, self._control):
            self._control_written()
        if _meet(written, self._offset):
            self.frame.set_offset(self.memory.get("offset"))
            self._stay_in_one_turn()
            self._reframe()
        self._take_address()

    def _take_address(self) -> None:
        """Update IDs and baud rate from their registers."""
        self.id = self.memory.get("id")
        """Primary ID."""
        # A secondary ID of 0 means none, because servo 0 of the hand has that ID.
        self.secondary_id = (self.memory.get("secondary_id") if self.model.has("secondary_id") else 0) or NO_ID
        """Secondary ID, for writes without an answer; `NO_ID` for none."""
        self.baud = self.model.baud_rates[self.memory.get("baud")]
        """Baud rate, bit/s."""

    def look_after(self, seconds: float) -> None:
        """Update the temperatures over the last `seconds` and apply the protections."""
        feedback, memory = self.feedback, self.memory
        feedback.refresh(self._shafts.sample(), self._acting, self._setpoint_counts)
        current_a = feedback.current_units * CURRENT_UNIT_MA / 1000.0
        speed = self.frame.counts_per_rad * self._shafts.sample().speeds[self._mounting.shaft]
        self._heat = self._heat.after(current_a, speed, seconds, self.parameters)
        feedback.temperature_c = sum(self._heat)
        was_hot = self._protection.hot
        feedback.status = self._protection.status(memory, seconds)
        memory.set("status", feedback.status)
        unload = memory.get("unload_conditions")
        if self._protection.overloaded and not self._wanted_is_weak():
            self._control_written()
        # Overload keeps the holding torque; the other protections switch the torque off.
        if feedback.status & unload & ~OVERLOAD and memory.get("torque_enable"):
            self._last_goal = None
            if self._protection.hot:
                self._wait_until_cool()
            memory.set("torque_enable", control.OFF)
            self._control_written()
        elif was_hot and not self._protection.hot and self._enable_when_cool:
            memory.set("torque_enable", self._enable_when_cool)
            self._enable_when_cool = control.OFF
            self._control_written()

    def _wait_until_cool(self) -> None:
        """Switch the torque off, and store the torque register for the time after cooling."""
        if self.memory.get("unload_conditions") & TEMPERATURE:
            self._enable_when_cool = self.memory.get("torque_enable")
            self.memory.set("torque_enable", control.OFF)

    def exchange_heat(self, other: Self) -> None:
        """Exchange case and motor temperatures with another servo, as two servos that change places do."""
        self._heat, other._heat = other._heat, self._heat
        for servo in (self, other):
            servo.feedback.temperature_c = sum(servo._heat)

    def heat_to(self, celsius: float) -> None:
        """Set case and motor to one temperature (°C)."""
        self._heat = Warmth(celsius)
        self.feedback.temperature_c = celsius

    def hold_write(self, address: int, data: bytes) -> None:
        """Buffer a write until `release_write` (REG WRITE)."""
        self._held = address, data
        self.memory.set("async_flag", 1)

    def release_write(self) -> None:
        """Apply the buffered write, if any (ACTION)."""
        if self._held is not None:
            held, self._held = self._held, None
            self.memory.set("async_flag", 0)
            self.write(*held)

    def calibrate(self, value: int | None) -> None:
        """Make the present angle read `value` counts, 2048 if None (CALIBRATE); stored if the EEPROM is unlocked."""
        self.frame.calibrate(self._angle(), MID_COUNTS if value is None else decode_signed(value))
        largest = (1 << self.model.places["offset"].sign_bit) - 1
        self.memory.set("offset", max(self.frame.offset, -largest))
        self.memory.keep("offset")
        self._reframe()

    def forget_turns(self) -> None:
        """Clear the counted turns (RESET)."""
        self.frame.forget_turns(self._angle())
        self._reframe()

    def _reframe(self) -> None:
        """Reapply the goal after a change of the conversion between counts and angles."""
        self.feedback.invalidate()
        self._last_goal = None
        self._motion = None
        self._setpoint_counts = float(self.frame.counts(self._angle()))
        self._kernel.call_at(self._shafts.next_tick(self._kernel.now), self._act, self._wanted, self._epoch)

    def restore(self) -> None:
        """Restore all factory registers except the ID (RESTORE)."""
        self.memory.restore()
        self._start_over()

    def reboot(self) -> None:
        """Power-cycle and stay silent for `reboot_s` (REBOOT)."""
        self.power_up()
        self.silent_until = self._kernel.now + self.parameters.reboot_s

    def power_up(self) -> None:
        """Restart from EEPROM without turns and goals; ready before the board (assumption)."""
        self.memory.power_up()
        self._start_over()

    def _start_over(self) -> None:
        self._held = self._last_goal = None
        self._protection = Protection(self.model)
        self.feedback.status = 0
        self._take_address()
        self.frame.set_offset(self.memory.get("offset"))
        self.forget_turns()
        self._at_power_up()
        self._control_written()

    def _at_power_up(self) -> LoopSettings:
        # The initial goal is the present position, so that enabling the torque does not move (assumption).
        goal = self.model.places["goal_position"]
        lowest = -goal.high if goal.sign_bit else goal.low
        self.memory.set("goal_position", min(max(self.frame.counts(self._angle()), lowest), goal.high))
        return LoopSettings.of(self.memory)

    @property
    def _holding_duty(self) -> int:
        """Holding torque after an overload, 0.1 % of full duty."""
        return 10 * self.memory.get("holding_torque")

    def _wanted_is_weak(self) -> bool:
        return self._wanted.duty_limit <= self._holding_duty

    def _stay_in_one_turn(self) -> None:
        """Clear the turns of a single-turn servo, so that goals lie within the present turn."""
        if not self.memory.get("phase") & MULTI_TURN:
            self.frame.forget_turns(self._angle())

    def _change_mode(self) -> None:
        """Clear the turns of a single-turn servo, so that a new position goal after speed mode does not unwind them."""
        if self.memory.get("phase") & MULTI_TURN:
            return
        self._stay_in_one_turn()
        self.feedback.invalidate()
        self._motion = None
        self._setpoint_counts = float(self.frame.counts(self._angle()))

    def _angle(self) -> float:
        return self._shafts.sample().angles[self._mounting.shaft]

    def _control_written(self, asked: LoopSettings | None = None) -> None:
        """Apply the control registers, with their settings in `asked` if already read."""
        self._asked = wanted = asked or LoopSettings.of(self.memory)
        if self._protection.overloaded:
            if wanted.enable and (not self._wanted.enable or wanted.position != self._wanted.position):
                self._protection.release()
            else:
                wanted = wanted._replace(duty_limit=min(wanted.duty_limit, self._holding_duty))
        if wanted == self._wanted:
            return
        if wanted.enable and not self._wanted.enable:
            self._protection.release()
            self._stay_in_one_turn()
        elif wanted.enable and wanted.mode != self._wanted.mode:
            self._change_mode()
        self._wanted = wanted
        if wanted.enable == control.OFF:
            # A new epoch cancels delayed goals, which would switch the torque on again.
            self._epoch += 1
            self._kernel.call_at(self._shafts.next_tick(self._kernel.now), self._act, wanted, self._epoch)
        else:
            at = self._kernel.now + self.parameters.goal_delay_s
            self._kernel.call_at(self._shafts.next_tick(at), self._act, wanted, self._epoch)

    def _act(self, settings: LoopSettings, epoch: int) -> None:
        if epoch != self._epoch:
            return
        now = self._kernel.now
        position, velocity = self._present_setpoint(now)
        before, self._acting = self._acting, settings
        self._motion = self._planned(settings, now, position, velocity)
        if self._motion is None and settings.mode == control.POSITION and settings.speed:
            position = self._bounded(settings.position)
        self._setpoint_counts = position
        shaft = self._mounting.shaft
        if settings.differs_by_setpoint(before):
            self._shafts.aim(shaft, self._aim())
        else:
            self._shafts.drive(shaft, settings.drive(self._aim(), self._mounting.direction, self.parameters))
        followed = self._motion is not None or settings.has_dead_zone
        self._shafts.follow(shaft, self._follow if followed else None)

    def _present_setpoint(self, now: float) -> tuple[float, float]:
        """Return the start of a new motion, counts and counts/s: the followed setpoint, else the shaft position."""
        if self._acting.enable == control.ON and self._acting.mode in {control.POSITION, control.SPEED}:
            return self._motion.at(now) if self._motion else (self._setpoint_counts, 0.0)
        return float(self.frame.counts(self._angle())), 0.0

    def _planned(self, settings: LoopSettings, now: float, position: float, velocity: float) -> Trapezoid | None:
        if settings.enable != control.ON:
            return None
        limits = settings.limits(self._fastest, self._acceleration_unit)
        if settings.mode == control.POSITION and limits is not None and limits[0] > 0.0:
            return plan(
                now, position, velocity, self._bounded(settings.position), speed=limits[0], acceleration=limits[1]
            )
        if settings.mode == control.SPEED and settings.speed:
            speed, acceleration = limits or (self._fastest, control.MOTOR_ACCELERATION)
            goal = position + (control.ENDLESS_COUNTS if settings.speed > 0 else -control.ENDLESS_COUNTS)
            return plan(now, position, velocity, goal, speed=speed, acceleration=acceleration)
        return None

    def _bounded(self, goal: int) -> float:
        # Limits apply to later goals only.
        limits = low, high = self.memory.get("min_angle"), self.memory.get("max_angle")
        if high > low and (self.parameters.clamp_goal or limits not in control.FREE_ANGLES):
            return float(min(max(goal, low), high))
        return float(goal)

    def _follow(self, t: float) -> float | None:
        motion = self._motion
        if motion is not None:
            self._setpoint_counts = motion.at(t)[0]
            if t >= motion.end:
                self._motion = None
        elif not self._acting.has_dead_zone:
            return None
        return self._aim()

    def _aim(self) -> float:
        """Return the target angle (rad) of the motor: the setpoint, or the present angle within the dead zone."""
        if self._acting.has_dead_zone:
            angle = self._angle()
            if self._acting.ignores(self._setpoint_counts - self.frame.counts(angle)):
                return angle
        return self.frame.angle(self._setpoint_counts)


def _meet(written: range, registers: range) -> bool:
    return written.start < registers.stop and written.stop > registers.start
