"""The Aero Hand Open in LeRobot: the robot `aero_hand` and the teleoperator `aero_twin`.

LeRobot imports this package when it starts, because its distribution is named `lerobot_robot_...`, and finds a device
beside its configuration by the name: `AeroHandRobotConfig` makes an `AeroHandRobot`.
"""

from lerobot_robot_aero.aero_hand_robot import AeroHandRobot
from lerobot_robot_aero.aero_twin import AeroTwin
from lerobot_robot_aero.config import AeroHandRobotConfig, AeroTwinConfig

__all__ = ["AeroHandRobot", "AeroHandRobotConfig", "AeroTwin", "AeroTwinConfig"]
