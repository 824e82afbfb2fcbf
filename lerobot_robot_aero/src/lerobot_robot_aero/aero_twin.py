"""Teleoperator `aero_twin`: angles from another hand or from a recording."""

import logging
from collections.abc import Callable
from contextlib import ExitStack
from functools import cached_property
from typing import Any

import numpy as np
from lerobot.lerobot_types import RobotAction
from lerobot.teleoperators import Teleoperator
from lerobot.utils.decorators import check_if_already_connected, check_if_not_connected
from numpy.typing import NDArray

from aero.channels import Channel
from aero.clock import Clock, WallClock
from lerobot_robot_aero.angles import POSITIONS, AngleMap, named
from lerobot_robot_aero.config import AeroTwinConfig
from lerobot_robot_aero.opening import opened
from lerobot_robot_aero.playback import Playback, load_playback

_LOG = logging.getLogger(__name__)
Source = Callable[[], NDArray[np.float64]]
"""Function that returns the present target angles (7,), degrees."""


class AeroTwin(Teleoperator):
    """Teleoperator that follows another hand or plays a recording.

    The other hand is only read, never commanded to a position. With `limp` its torque is first set to zero, which
    requires firmware 0.1.0 or later.
    """

    config_class = AeroTwinConfig
    name = "aero_twin"

    def __init__(self, config: AeroTwinConfig) -> None:
        """Prepare the teleoperator; `connect` opens the hand or the recording."""
        super().__init__(config)
        self.config = config
        self._open = ExitStack()
        self._source: Source | None = None

    @cached_property
    def action_features(self) -> dict[str, type]:
        """Names and types of the seven angles, degrees."""
        return dict.fromkeys(POSITIONS, float)

    @property
    def feedback_features(self) -> dict[str, type]:
        """Empty: the other hand has no force feedback."""
        return {}

    @property
    def is_connected(self) -> bool:
        """Whether a source of angles is open."""
        return self._source is not None

    @property
    def is_calibrated(self) -> bool:
        """Always true, as for the robot."""
        return True

    @check_if_already_connected
    def connect(self, calibrate: bool = True) -> None:
        """Open the other hand and release its torque, or read the recording.

        Raises:
            NoHandError: nothing answers at the port.
            OSError, UnusableFileError: the recording cannot be read, or cannot be played.
        """
        if self.config.recording is not None:
            self._source = played(load_playback(self.config.recording), WallClock(), repeat=self.config.repeat)
            return
        with ExitStack() as stack:
            target = stack.enter_context(opened(self.config, guarded=False))
            angles = AngleMap.corrected(target.map, self.config.correction)
            if self.config.limp:
                target.hand.command_torques([0] * len(Channel))
            self._open = stack.pop_all()
        self._source = lambda: angles.degrees(target.hand.read_codes())
        _LOG.info("following %s", target.describe())

    def configure(self) -> None:
        """Do nothing; `connect` releases the torque of the other hand."""

    def calibrate(self) -> None:
        """Do nothing; the other hand homes at power-on."""

    @check_if_not_connected
    def get_action(self) -> RobotAction:
        """Return the seven angles, degrees; a recording starts at the first call.

        Raises:
            AeroError, ConnectionError: the other hand's board does not answer, or the link is disconnected.
        """
        assert self._source is not None
        return named(self._source())

    def send_feedback(self, feedback: dict[str, Any]) -> None:
        """Do nothing."""

    @check_if_not_connected
    def disconnect(self) -> None:
        """Close the port; the other hand stays as it is."""
        self._source = None
        self._open.close()


def played(playback: Playback, clock: Clock, *, repeat: bool) -> Source:
    """Return a source that starts playback at its first call."""
    began: list[float] = []

    def angles() -> NDArray[np.float64]:
        began[:] = began or [clock.now()]
        return playback.at(clock.now() - began[0], repeat=repeat)

    return angles
