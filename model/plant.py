"""The built hand as the servos see it: seven output shafts in time, and the ground truth behind them.

The inner loop of each servo is an actuator of the physics engine, rewritten when its drive changes, so many physics
steps run in one call and Python acts only where the electronics do. Implements `firmware_emulator.plant.Plant` by
its shape.
"""

from __future__ import annotations

from math import isfinite
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from aero.channels import CABLES
from aero.exit_code import Exit
from firmware_emulator.plant import Drive, Plant, ShaftState
from model.built import build_built
from model.compiled_hand import SHAFTS, UNPOWERED, CompiledHand
from model.geometry import Side
from model.parameters import BuiltHandParameters

TIME_RESOLUTION = 1e-9
"""Spans shorter than this are not integrated, s; a microsecond is the finest thing on the servo bus."""
CABLE_SHAFTS = list(CABLES)
TURNING = 0.1
"""Speed at which a spool turns, rad/s; 65 counts/s."""
NOTICEABLE = 0.003
"""Change of the supply from which on the drives are updated, fraction of nominal."""
FAR_M, FAR_RAD = 0.1, 0.5
"""Stretch of a cable and angle behind a stop that no fault of a hand gives."""
LEAST_SUPPLY = 0.3
"""What a supply keeps, share of nominal."""


class DivergedError(ArithmeticError):
    """A hand cannot be simulated as its unit and its faults say; the message has the drives under which it failed."""

    exit_code = Exit.USAGE


class Glimpse(NamedTuple):
    """Ground-truth snapshot of the hand, as the physics engine last computed it."""

    time: float
    """Simulated time, s."""
    joints: NDArray[np.float64]
    """Joint angles, (16,) rad, in the order of `Joint`."""
    tensions: NDArray[np.float64]
    """Cable tensions, (7,) N; NaN for abduction, which has no cable."""
    loose: NDArray[np.float64]
    """How much cable is loose, (7,) m; zero or less when taut, NaN for abduction."""


class BuiltHandPlant(Plant):
    """Seven output shafts with spools, cables, joints and return springs behind them.

    Starts at rest in the extended pose, held closed only by cables that are much too short for it, unpowered.
    Deterministic: the same calls give the same state to the bit.
    Time is cut where the caller cuts it, by a last shortened step, so a drive changes exactly when it is changed.
    """

    def __init__(self, parameters: BuiltHandParameters | None = None, hand: Side = "right", *, seed: int = 0) -> None:
        """Build the hand; `seed` draws how its sheaths rub in each motion."""
        self.parameters = parameters or BuiltHandParameters()
        self._hand: Side = hand
        self.compiled = CompiledHand(self._spec(hand), self.parameters)
        """The hand behind the motion; `drive` writes into it."""
        self._model = self.compiled.model
        self._data = mujoco.MjData(self._model)
        # MuJoCo's own memory, looked up once; each look-up makes an array.
        self._warnings, self._setpoints = self._data.warning.number, self._data.ctrl
        self._positions, self._velocities = self._data.qpos, self._data.qvel
        self._tensions = self._data.sensordata[self.compiled.tension_sensors]
        joints, shafts = self.compiled.at_rest()
        # In this order: the shaft of abduction is its joint.
        self._positions[self.compiled.shaft_qpos] = shafts
        self._positions[self.compiled.joint_qpos] = joints
        self._time = 0.0
        self._asked = [UNPOWERED] * SHAFTS
        self._laws = [(0.0, 0.0, 0.0, 0.0)] * SHAFTS
        """Torque, stiffness, damping and limit of the drives."""
        self._goals = [0.0] * SHAFTS
        self._state: ShaftState | None = None
        """Of the shafts, from one read of MuJoCo's memory; None since something changed."""
        self._friction_factors = np.ones(len(CABLES))
        self._turning = [0.0] * len(CABLES)
        # A generator for each cable: its friction does not depend on the motion of the others.
        self._random = [np.random.default_rng([seed, cable]) for cable in CABLES]

    @property
    def time(self) -> float:
        """Simulated time, s."""
        return self._time

    def advance_to(self, t: float) -> None:
        """Integrate to exactly `t` (s) with the present drives; nothing happens when `t` is not later than `time`.

        Raises:
            DivergedError: the physics diverged.
        """
        span = t - self._time
        if span <= 0.0:
            return
        model, data, step = self._model, self._data, self.parameters.timestep
        # Between two calls, 10 ms apart at most while the board reads its servos, friction and supply are held.
        if self.compiled.has_sheaths:
            self.compiled.rub(self._tensions, self._sheaths())
        if self.parameters.supply_sag:
            self._sag()
        full = int(span / step + TIME_RESOLUTION)
        if full:
            mujoco.mj_step(model, data, full)
        rest = span - full * step
        if rest > TIME_RESOLUTION:
            model.opt.timestep = rest
            mujoco.mj_step(model, data)
            model.opt.timestep = step
        # A huge number may become none without a warning of MuJoCo.
        if any(self._warnings.tolist()) or not isfinite(sum(self._positions.tolist())):
            # MuJoCo has started over from the initial state by itself; there is nothing to go on with.
            raise DivergedError(
                "a hand with these numbers of its unit and these faults cannot be simulated: the built hand's physics "
                f"failed between {self._time} and {t} s under the drives (setpoint, "
                f"stiffness, damping, torque, limit; a row a shaft) {self._asked}"
            )
        self._state = None
        self._time = data.time = t

    def drive(self, shaft: int, drive: Drive) -> None:
        """Replace the drive of one shaft (0..6, command order) from now on.

        Raises:
            ValueError: a value that is not finite, or a negative stiffness, damping or limit.
            IndexError: no such shaft.
        """
        self._check(shaft)
        values = (drive.setpoint, drive.stiffness, drive.damping, drive.torque, drive.limit)
        if not all(map(isfinite, values)) or min(drive.stiffness, drive.damping, drive.limit) < 0.0:
            raise ValueError(f"a drive is finite with stiffness, damping and limit not negative, not {drive}")
        if not drive.current_limit >= 0.0:
            raise ValueError(f"a current limit is not negative, not {drive.current_limit}")
        self._asked[shaft] = drive
        self._laws[shaft] = drive.torque, drive.stiffness, drive.damping, drive.limit
        self._goals[shaft] = self._setpoints[shaft] = drive.setpoint
        self._state = None
        self.compiled.drive(shaft, drive)

    def set_setpoint(self, shaft: int, setpoint: float) -> None:
        """Change only the goal angle (rad) of one shaft's present drive; the cheap call a motion profile makes.

        Raises:
            ValueError: not finite.
            IndexError: no such shaft.
        """
        self._check(shaft)
        if not isfinite(setpoint):
            raise ValueError(f"a setpoint is a finite angle in rad, not {setpoint}")
        self._goals[shaft] = self._setpoints[shaft] = setpoint
        self._state = None

    def become(self, parameters: BuiltHandParameters) -> None:
        """Replace the parameters and keep the state: something broke, slipped or was mended.

        Args:
            parameters: of the same parts; contacts and the thenar stop stay as they are.

        Raises:
            ValueError: they describe a hand of other parts.
        """
        kept = self.parameters
        if (parameters.contacts, parameters.thenar_radius) != (kept.contacts, kept.thenar_radius):
            raise ValueError("a hand that moves keeps its parts: contacts and thenar_radius cannot change")
        self.parameters = parameters
        self.compiled = CompiledHand(self._spec(self._hand), parameters)
        self._model = self.compiled.model
        for shaft, drive in enumerate(self._asked):
            self.compiled.drive(shaft, drive)
        self._bring_back()

    def _bring_back(self) -> None:
        """Turn back what ran away while nothing held it, as whoever mends it does before it is held again.

        A spool without its cable turns by metres of it, a joint without its stop by turns. Held again at once, they
        would be thrown back with more energy than the physics can follow.
        """
        joints = self._positions[self.compiled.joint_qpos]
        inside = np.clip(joints, *self._model.jnt_range[self.compiled.joint_qpos].T)
        away = np.abs(joints - inside) > FAR_RAD
        if away.any():
            self._positions[self.compiled.joint_qpos[away]] = inside[away]
            self._velocities[self.compiled.joint_dofs[away]] = 0.0
        stretched = self.compiled.loose(self._data) < -FAR_M
        if stretched.any():
            shafts = self.compiled.shaft_qpos[CABLE_SHAFTS][stretched]
            loose = []
            for turned in (0.0, 1.0):  # the cable is wound in proportion to the angle
                self._positions[shafts] -= turned
                mujoco.mj_fwdPosition(self._model, self._data)
                loose.append(self.compiled.loose(self._data)[stretched])
            self._positions[shafts] += loose[1] / (loose[1] - loose[0])
            self._velocities[self.compiled.shaft_dofs[CABLE_SHAFTS][stretched]] = 0.0
        self._state = None

    def state(self) -> ShaftState:
        """Return angles, speeds and efforts of the shafts; one state is read once, however often it is asked for."""
        if self._state is None:
            angles = self._positions.take(self.compiled.shaft_qpos).tolist()
            speeds = self._velocities.take(self.compiled.shaft_dofs).tolist()
            # Seven numbers are handled as numbers, at a third of what arrays of them take.
            efforts = []
            for (torque, stiffness, damping, limit), goal, angle, speed in zip(
                self._laws, self._goals, angles, speeds, strict=True
            ):
                effort = torque + stiffness * (goal - angle) - damping * speed
                efforts.append(limit if effort > limit else -limit if effort < -limit else effort)
            self._state = ShaftState(angles, speeds, efforts)
        return self._state

    def push(self, torques: NDArray[np.float64]) -> None:
        """Push the joints from outside with (16,) N m, in the order of `Joint`, until told otherwise."""
        self._data.qfrc_applied[self.compiled.joint_dofs] = torques

    def twist(self, shaft: int, torque: float) -> None:
        """Turn one shaft from outside with a torque, N m, until told otherwise; positive closes."""
        self._data.qfrc_applied[self.compiled.shaft_dofs[shaft]] = torque

    def joint_angles(self) -> NDArray[np.float64]:
        """Return the true joint angles, (16,) float, rad, in the order of `Joint`."""
        angles: NDArray[np.float64] = self._data.qpos[self.compiled.joint_qpos]
        return angles

    def cable_tensions(self) -> NDArray[np.float64]:
        """Return the true cable tensions at the present state, (7,) float, N, never negative; abduction reads zero."""
        mujoco.mj_forward(self._model, self._data)
        tensions = np.zeros(SHAFTS)
        tensions[list(CABLES)] = self.compiled.tensions(self._data)
        return tensions

    def slack(self) -> NDArray[np.float64]:
        """Return how much cable is loose, (7,) float, m; zero when taut, and for abduction, which has no cable."""
        mujoco.mj_fwdPosition(self._model, self._data)
        slack = np.zeros(SHAFTS)
        slack[list(CABLES)] = np.maximum(self.compiled.loose(self._data), 0.0)
        return slack

    def glimpse(self) -> Glimpse:
        """Return what is known without computing anything, so that another thread may look on.

        Reads only: `cable_tensions` and `slack` are exact at this instant, but they write into MuJoCo's data.
        """
        hand, data = self.compiled, self._data
        tensions, loose = np.full((2, SHAFTS), np.nan)
        tensions[list(CABLES)], loose[list(CABLES)] = hand.tensions(data), hand.loose(data)
        return Glimpse(self._time, data.qpos[hand.joint_qpos], tensions, loose)

    def _spec(self, hand: Side) -> mujoco.MjSpec:
        """Describe what is simulated; a plant with more around the hand adds it here."""
        return build_built(hand, self.parameters)

    def _sheaths(self) -> NDArray[np.float64]:
        """Return the factors on the friction of the sheaths, (6,); a cable that turns round settles in another way."""
        spread = self.parameters.cable_friction_spread
        if spread:
            speeds, turning = self.state().speeds, self._turning
            for cable, shaft in enumerate(CABLE_SHAFTS):
                speed = speeds[shaft]
                if -TURNING <= speed <= TURNING:
                    continue
                direction = 1.0 if speed > 0.0 else -1.0
                if direction != turning[cable]:
                    turning[cable] = direction
                    self._friction_factors[cable] = max(0.0, 1.0 + spread * self._random[cable].standard_normal())
        return self._friction_factors

    def _sag(self) -> None:
        """Lower the supply by what the motors draw, where that changes it noticeably."""
        hand, unit, drawn = self.compiled, self.parameters, 0.0
        present, back_emf = hand.supply, unit.back_emf
        _, speeds, efforts = self.state()
        for drive, speed, nominal in zip(self._asked, speeds, efforts, strict=True):
            effort, most = present * nominal, drive.current_limit
            winding = effort - back_emf * speed
            winding = most if winding > most else -most if winding < -most else winding
            # A bridge draws the winding's current for as much of the time as its duty; a motor that brakes gives none
            # back.
            if (power := effort * winding) > 0.0:
                drawn += power
        supply = unit.supply_ratio * max(1.0 - unit.supply_sag * drawn, LEAST_SUPPLY)
        if abs(supply - present) > NOTICEABLE:
            hand.supply_changed(supply)

    def _check(self, shaft: int) -> None:
        if not 0 <= shaft < SHAFTS:
            raise IndexError(f"shafts are 0..{SHAFTS - 1} in command order, not {shaft}")
