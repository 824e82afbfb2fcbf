"""Plant of the built hand: seven output shafts for the servos, and the ground truth behind them.

The inner loop of each servo is an actuator of the physics engine, rewritten when its drive changes. Many physics steps
thus run in one call, and Python runs only when the electronics act.
"""

from math import isfinite
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from aero.channels import CABLES
from aero.exit_code import Exit
from aero.side import Side
from firmware_emulator.plant import Drive, Plant, ShaftState
from model.built import build_built
from model.compiled_hand import SHAFTS, UNPOWERED, CompiledHand
from model.parameters import BuiltHandParameters

TIME_RESOLUTION = 1e-9
"""Threshold of a time span, s; shorter spans are not integrated. Times on the servo bus are at least a microsecond."""
CABLE_SHAFTS = list(CABLES)
TURNING = 0.1
"""Threshold of a spool's speed, rad/s (65 counts/s); above it the spool counts as turning."""
NOTICEABLE = 0.003
"""Threshold of a supply change, fraction of nominal; above it the drives are updated."""
FAR_M, FAR_RAD = 0.1, 0.5
"""Thresholds of cable stretch, m, and of the angle beyond a stop, rad; above them the state is reset after a repair."""
PARTS = ("contacts", "thenar_radius", "thumb_binding")
"""Parameters that determine the parts of the model, so a running hand keeps them."""
LEAST_SUPPLY = 0.3
"""Lower limit of the sagged supply, fraction of the unit's supply."""


class DivergedError(ArithmeticError):
    """The physics diverged with the unit's parameters and faults; the message has the drives at the failure."""

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
    """Cable slack, (7,) m; zero or less when taut, NaN for abduction."""


class BuiltHandPlant(Plant):
    """Seven output shafts with spools, cables, joints and return springs behind them.

    Starts unpowered and at rest in the extended pose, except for digits kept closed by a very short cable.
    Deterministic: equal calls give bit-identical states. The last step of a call is shortened to end exactly at the
    caller's time, so drives change exactly on time.
    """

    def __init__(self, parameters: BuiltHandParameters | None = None, side: Side = "right", *, seed: int = 0) -> None:
        """Build the hand; `seed` determines the sheath friction of each motion."""
        self.parameters = parameters or BuiltHandParameters()
        self._side: Side = side
        self.compiled = CompiledHand(self._spec(side), self.parameters)
        self._model = self.compiled.model
        self._data = mujoco.MjData(self._model)
        # Views of MuJoCo's memory, cached because each attribute access creates an array.
        self._warnings, self._setpoints = self._data.warning.number, self._data.ctrl
        self._positions, self._velocities = self._data.qpos, self._data.qvel
        self._tensions = self._data.sensordata[self.compiled.tension_sensors]
        joints, shafts = self.compiled.at_rest()
        # Joints after shafts, because the shaft of abduction is its joint.
        self._positions[self.compiled.shaft_qpos] = shafts
        self._positions[self.compiled.joint_qpos] = joints
        self._time = 0.0
        self._asked = [UNPOWERED] * SHAFTS
        self._laws = [(0.0, 0.0, 0.0, 0.0)] * SHAFTS
        """Torque, stiffness, damping and limit of the drives."""
        self._goals = [0.0] * SHAFTS
        self._state: ShaftState | None = None
        """Cached state of the shafts; None after a change."""
        self._friction_factors = np.ones(len(CABLES))
        self._turning = [0.0] * len(CABLES)
        # One generator a cable, so that its friction is independent of the motion of other cables.
        self._random = [np.random.default_rng([seed, cable]) for cable in CABLES]

    @property
    def time(self) -> float:
        """Simulated time, s."""
        return self._time

    def advance_to(self, t: float) -> None:
        """Integrate to exactly `t` (s) with the current drives; no effect if `t` is not later than `time`.

        Raises:
            DivergedError: the physics diverged.
        """
        span = t - self._time
        if span <= 0.0:
            return
        model, data, step = self._model, self._data, self.parameters.timestep
        # Friction and supply are constant during a call; calls are at most 10 ms apart while the board reads servos.
        if self.compiled.has_sheaths:
            self.compiled.rub(self._tensions, self._sheaths())
        if self.parameters.supply_sag:
            self._sag()
        self.compiled.bind(data)
        full = int(span / step + TIME_RESOLUTION)
        if full:
            mujoco.mj_step(model, data, full)
        rest = span - full * step
        if rest > TIME_RESOLUTION:
            model.opt.timestep = rest
            mujoco.mj_step(model, data)
            model.opt.timestep = step
        # Positions can overflow to NaN without a warning of MuJoCo.
        if any(self._warnings.tolist()) or not isfinite(sum(self._positions.tolist())):
            # MuJoCo has reset itself to the initial state, so the simulation cannot continue.
            raise DivergedError(
                "a hand with these numbers of its unit and these faults cannot be simulated: the built hand's physics "
                f"failed between {self._time} and {t} s under the drives (setpoint, "
                f"stiffness, damping, torque, limit; a row a shaft) {self._asked}"
            )
        self._state = None
        self._time = data.time = t

    def drive(self, shaft: int, drive: Drive) -> None:
        """Replace the drive of one shaft (0..6, command order).

        Raises:
            ValueError: a value that is not finite, or a negative stiffness, damping or limit.
            IndexError: shaft out of range.
        """
        self._check(shaft)
        values = (drive.setpoint, drive.stiffness, drive.damping, drive.torque, drive.limit)
        if not all(map(isfinite, values)) or min(drive.stiffness, drive.damping, drive.limit) < 0.0:
            raise ValueError(f"a drive is finite with stiffness, damping and limit not negative, not {drive}")
        if not drive.current_limit >= 0.0:
            raise ValueError(f"a current limit must not be negative, got {drive.current_limit}")
        self._asked[shaft] = drive
        self._laws[shaft] = drive.torque, drive.stiffness, drive.damping, drive.limit
        self._goals[shaft] = self._setpoints[shaft] = drive.setpoint
        self._state = None
        self.compiled.drive(shaft, drive)

    def set_setpoint(self, shaft: int, setpoint: float) -> None:
        """Change only the goal angle (rad) of one shaft's drive; the cheap call for motion profiles.

        Raises:
            ValueError: not finite.
            IndexError: shaft out of range.
        """
        self._check(shaft)
        if not isfinite(setpoint):
            raise ValueError(f"a setpoint is a finite angle in rad, not {setpoint}")
        self._goals[shaft] = self._setpoints[shaft] = setpoint
        self._state = None

    def become(self, parameters: BuiltHandParameters) -> None:
        """Replace the parameters and keep the state, as for a fault or a repair.

        Args:
            parameters: new parameters, with equal `PARTS`.

        Raises:
            ValueError: another value of one of `PARTS`.
        """
        if any(getattr(parameters, part) != getattr(self.parameters, part) for part in PARTS):
            raise ValueError(f"a hand that moves keeps its parts: {', '.join(PARTS)} cannot change")
        self.parameters = parameters
        self.compiled = CompiledHand(self._spec(self._side), parameters)
        self._model = self.compiled.model
        for shaft, drive in enumerate(self._asked):
            self.compiled.drive(shaft, drive)
        self._bring_back()

    def _bring_back(self) -> None:
        """Reset joints far beyond their stops and spools with far stretched cables, as a repair does.

        A spool without its cable winds metres, and a joint without its stop makes whole turns. Restored at once, their
        constraints would release more energy than the physics can integrate.
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
            for turned in (0.0, 1.0):  # two points suffice: the length is linear in the angle
                self._positions[shafts] -= turned
                mujoco.mj_fwdPosition(self._model, self._data)
                loose.append(self.compiled.loose(self._data)[stretched])
            self._positions[shafts] += loose[1] / (loose[1] - loose[0])
            self._velocities[self.compiled.shaft_dofs[CABLE_SHAFTS][stretched]] = 0.0
        self._state = None

    def state(self) -> ShaftState:
        """Return angles, speeds and efforts of the shafts; cached until the next change."""
        if self._state is None:
            angles = self._positions.take(self.compiled.shaft_qpos).tolist()
            speeds = self._velocities.take(self.compiled.shaft_dofs).tolist()
            # Plain numbers, because arrays of seven take three times as long.
            efforts = []
            for (torque, stiffness, damping, limit), goal, angle, speed in zip(
                self._laws, self._goals, angles, speeds, strict=True
            ):
                effort = torque + stiffness * (goal - angle) - damping * speed
                efforts.append(limit if effort > limit else -limit if effort < -limit else effort)
            self._state = ShaftState(angles, speeds, efforts)
        return self._state

    def push(self, torques: NDArray[np.float64]) -> None:
        """Apply external joint torques, (16,) N m, in the order of `Joint`, until the next call."""
        self._data.qfrc_applied[self.compiled.joint_dofs] = torques

    def joint_angles(self) -> NDArray[np.float64]:
        """Return the true joint angles, (16,) float, rad, in the order of `Joint`."""
        angles: NDArray[np.float64] = self._data.qpos[self.compiled.joint_qpos]
        return angles

    def cable_tensions(self) -> NDArray[np.float64]:
        """Return the true cable tensions, (7,) float, N, not negative; zero for abduction."""
        mujoco.mj_forward(self._model, self._data)
        tensions = np.zeros(SHAFTS)
        tensions[list(CABLES)] = self.compiled.tensions(self._data)
        return tensions

    def slack(self) -> NDArray[np.float64]:
        """Return the cable slack, (7,) float, m; zero when taut and for abduction."""
        mujoco.mj_fwdPosition(self._model, self._data)
        slack = np.zeros(SHAFTS)
        slack[list(CABLES)] = np.maximum(self.compiled.loose(self._data), 0.0)
        return slack

    def glimpse(self) -> Glimpse:
        """Return a snapshot of the last computed state, read-only and thus safe in another thread.

        `cable_tensions` and `slack` are exact at the current time, but write into MuJoCo's data.
        """
        compiled, data = self.compiled, self._data
        tensions, loose = np.full((2, SHAFTS), np.nan)
        tensions[list(CABLES)], loose[list(CABLES)] = compiled.tensions(data), compiled.loose(data)
        return Glimpse(self._time, data.qpos[compiled.joint_qpos], tensions, loose)

    def _spec(self, side: Side) -> mujoco.MjSpec:
        """Return the spec to simulate; subclasses add objects around the hand."""
        return build_built(side, self.parameters)

    def _sheaths(self) -> NDArray[np.float64]:
        """Return the factors on sheath friction, (6,); each reversal of a cable draws a new factor."""
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
        """Lower the supply by the motors' power, if the change exceeds `NOTICEABLE`."""
        compiled, unit, drawn = self.compiled, self.parameters, 0.0
        present, back_emf = compiled.supply, unit.back_emf
        _, speeds, efforts = self.state()
        for drive, speed, nominal in zip(self._asked, speeds, efforts, strict=True):
            effort, most = present * nominal, drive.current_limit
            winding = effort - back_emf * speed
            winding = most if winding > most else -most if winding < -most else winding
            # A bridge draws duty times winding current; a braking motor does not feed back.
            if (power := effort * winding) > 0.0:
                drawn += power
        supply = unit.supply_ratio * max(1.0 - unit.supply_sag * drawn, LEAST_SUPPLY)
        if abs(supply - present) > NOTICEABLE:
            compiled.supply_changed(supply)

    def _check(self, shaft: int) -> None:
        if not 0 <= shaft < SHAFTS:
            raise IndexError(f"shafts are 0..{SHAFTS - 1} in command order, not {shaft}")
