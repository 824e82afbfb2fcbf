"""Robot `aero_hand`: a guarded hand with the interface of LeRobot."""

import logging
import threading
from contextlib import ExitStack
from functools import cached_property

import numpy as np
from lerobot.cameras import make_cameras_from_configs
from lerobot.lerobot_types import RobotAction, RobotObservation
from lerobot.robots import Robot
from lerobot.robots.utils import ensure_safe_goal_position
from lerobot.utils.decorators import check_if_already_connected, check_if_not_connected

from aero.actuation import ActuationMap
from hil.targets.target import Target
from lerobot_robot_aero.angles import CURRENTS, POSITIONS, AngleMap, listed, named
from lerobot_robot_aero.config import AeroHandRobotConfig
from lerobot_robot_aero.idle_watch import IdleWatch
from lerobot_robot_aero.opening import opened, spec_of

_LOG = logging.getLogger(__name__)


class AeroHandRobot(Robot):
    """Aero Hand Open, guarded during all motion; opened and set to low torque on disconnect.

    Observations are seven angles, degrees (`index.pos` ...), optionally seven motor currents, A (`index.current` ...),
    both in command order, and the images of the cameras. Actions are seven angles.
    """

    config_class = AeroHandRobotConfig
    name = "aero_hand"

    def __init__(self, config: AeroHandRobotConfig) -> None:
        """Prepare a hand; `connect` opens the port.

        Raises:
            ValueError: an unknown side, firmware or unit.
        """
        super().__init__(config)
        self.config = config
        self.cameras = make_cameras_from_configs(config.cameras)
        hand = spec_of(config)
        codec = ActuationMap.for_firmware(hand.firmware, side=hand.side)
        self._angles = AngleMap.corrected(codec, config.correction)
        self._lock = threading.Lock()
        self._open = ExitStack()
        self._target: Target | None = None

    @cached_property
    def observation_features(self) -> dict[str, type | tuple[int, ...]]:
        """Names and types of the observations; shapes for images."""
        names = POSITIONS + CURRENTS if self.config.currents else POSITIONS
        images = {name: (camera.height, camera.width, 3) for name, camera in self.config.cameras.items()}
        return {**dict.fromkeys(names, float), **images}

    @cached_property
    def action_features(self) -> dict[str, type]:
        """Names and types of the seven angles, degrees."""
        return dict.fromkeys(POSITIONS, float)

    @property
    def is_connected(self) -> bool:
        """Whether the hand is connected."""
        return self._target is not None

    @property
    def is_calibrated(self) -> bool:
        """Always true: the board homes at power-on, and `calibrate` homes again."""
        return True

    @check_if_already_connected
    def connect(self, calibrate: bool = True) -> None:
        """Open the port, check the hand, and open the fingers slowly.

        Raises:
            NoHandError: nothing answers at the port.
            SafetyStopError: the check failed, or the hand did not open.
        """
        with ExitStack() as stack:
            for camera in self.cameras.values():
                camera.connect()
                stack.callback(camera.disconnect)
            self._target = stack.enter_context(opened(self.config, guarded=True))
            stack.callback(self._forget)
            self.configure()
            if self._target.real_time:  # a hand on virtual time stands still between calls
                stack.enter_context(IdleWatch(self._target.hand, self._lock))
            self._open = stack.pop_all()
        _LOG.info("connected to %s", self._target.describe())

    def configure(self) -> None:
        """Check the hand and open it slowly, unless already done; afterwards the normal limits apply."""
        with self._lock:
            self._connected.begin()

    @check_if_not_connected
    def calibrate(self) -> None:
        """Home the hand, starting from open fingers."""
        with self._lock:
            self._connected.hand.home()

    @check_if_not_connected
    def get_observation(self) -> RobotObservation:
        """Read the hand and its cameras.

        Raises:
            SafetyStopError: the guard has opened the hand; the message gives the reason.
            AeroError, ConnectionError: the board does not answer, or the link is disconnected.
        """
        hand = self._connected.hand
        with self._lock:
            observation = named(self._angles.degrees(hand.read_codes()))
            if self.config.currents:
                observation |= dict(zip(CURRENTS, hand.read_currents().tolist(), strict=True))
        return observation | {name: camera.read_latest() for name, camera in self.cameras.items()}

    @check_if_not_connected
    def send_action(self, action: RobotAction) -> RobotAction:
        """Command seven angles and return the angles sent.

        The sent angles are clipped to the command window and to `max_relative_target`.

        Raises:
            ValueError: an angle is missing or not finite; nothing is sent.
            SafetyStopError, AeroError, ConnectionError: as `get_observation`.
        """
        hand, wanted = self._connected.hand, listed(action)
        with self._lock:
            if self.config.max_relative_target is not None:
                stands = self._angles.degrees(hand.read_codes())
                pairs = dict(zip(POSITIONS, zip(wanted, stands, strict=True), strict=True))
                wanted = np.array([*ensure_safe_goal_position(pairs, self.config.max_relative_target).values()])
            codes = self._angles.codes(wanted)
            hand.command_codes(codes)
        return named(self._angles.degrees(codes))

    @check_if_not_connected
    def disconnect(self) -> None:
        """Open the hand slowly, set low torque, and close the port.

        Raises:
            SafetyStopError: the hand may not be open; the message says what to do.
        """
        self._open.close()
        _LOG.info("%s disconnected", self)

    @property
    def _connected(self) -> Target:
        assert self._target is not None, "connect() comes first"
        return self._target

    def _forget(self) -> None:
        self._target = None
