"""Aero Hand Open in LeRobot: the robot `aero_hand` and the teleoperator `aero_twin`.

LeRobot imports this package at startup because of its distribution's name, `lerobot_robot_...`, and finds a device by
the name of its configuration: `AeroHandRobotConfig` creates an `AeroHandRobot`.
"""

from lerobot_robot_aero.aero_hand_robot import AeroHandRobot
from lerobot_robot_aero.aero_twin import AeroTwin
from lerobot_robot_aero.config import AeroHandRobotConfig, AeroTwinConfig

__all__ = ["AeroHandRobot", "AeroHandRobotConfig", "AeroTwin", "AeroTwinConfig"]
