"""The teleoperator `aero_twin`: the angles of another hand, or of a recording."""

from __future__ import annotations

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
"""Returns the angles (7,), degrees, that the robot is to take now."""


class AeroTwin(Teleoperator):
    """Another hand that the robot follows, or a recording that it plays.

    The other hand is read and never sent to a position. It is let go first (`limp`), with a torque of zero, which
    firmware before 0.1.0 does not know.
    """

    config_class = AeroTwinConfig
    name = "aero_twin"

    def __init__(self, config: AeroTwinConfig) -> None:
        """Prepare it; nothing is opened before `connect`."""
        super().__init__(config)
        self.config = config
        self._open = ExitStack()
        self._source: Source | None = None

    @cached_property
    def action_features(self) -> dict[str, type]:
        """Names of the seven angles, degrees, and their types."""
        return dict.fromkeys(POSITIONS, float)

    @property
    def feedback_features(self) -> dict[str, type]:
        """Nothing: the other hand feels nothing."""
        return {}

    @property
    def is_connected(self) -> bool:
        """Whether there are angles."""
        return self._source is not None

    @property
    def is_calibrated(self) -> bool:
        """Always, as the robot."""
        return True

    @check_if_already_connected
    def connect(self, calibrate: bool = True) -> None:
        """Open the other hand and let it go, or read the recording.

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
        """Do nothing; `connect` has let the other hand go."""

    def calibrate(self) -> None:
        """Do nothing; the other hand homes when it is switched on."""

    @check_if_not_connected
    def get_action(self) -> RobotAction:
        """Return the seven angles, degrees; a recording begins with the first call.

        Raises:
            AeroError, ConnectionError: the other hand's board does not answer, or the link is gone.
        """
        assert self._source is not None
        return named(self._source())

    def send_feedback(self, feedback: dict[str, Any]) -> None:
        """Do nothing."""

    @check_if_not_connected
    def disconnect(self) -> None:
        """Give the port back; the other hand stays as it is."""
        self._source = None
        self._open.close()


def played(playback: Playback, clock: Clock, *, repeat: bool) -> Source:
    """Return a source that begins a recording when it is first asked."""
    began: list[float] = []

    def angles() -> NDArray[np.float64]:
        began[:] = began or [clock.now()]
        return playback.at(clock.now() - began[0], repeat=repeat)

    return angles
