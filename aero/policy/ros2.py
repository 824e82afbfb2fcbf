"""A policy on a hand behind the official ROS 2 node: a thin shell over the same loop. Imports `rclpy`.

    python -m aero.policy.ros2 POLICY --ros-args -p seconds:=15.0

Start the official node with `control_space:=actuator`, else it does not listen to the topic written here. Topics and
messages are those of `aero_hand_open_msgs`: `right/actuator_states` in, `right/actuator_control` out, both in degrees
of the shafts in hand order (which is the wire order).
"""

from __future__ import annotations

import sys
import threading
from pathlib import Path

import numpy as np
import rclpy
from aero_hand_open_msgs.msg import ActuatorControl, ActuatorStates
from numpy.typing import ArrayLike, NDArray
from rclpy.node import Node

from aero.actuation import ActuationMap
from aero.channels import WIRE_ORDER
from aero.clock import Clock, Deadline, WallClock
from aero.errors import LinkTimeoutError
from aero.policy.file import load
from aero.policy.loop import run_policy
from aero.policy.running import Run, RunSettings

STALE_S = 0.1
"""Age from which a state counts as missing, s; the official node publishes a hundred a second."""
FIRST_STATE_S = 5.0
"""Patience for the first state, s."""

Floats = NDArray[np.float64]


class RosHand:
    """A hand behind the official node, as the loop wants it (`aero.policy.running.Hand`).

    The lock covers the latest state, which the executor's thread writes and the loop's thread reads.
    """

    def __init__(self, node: Node, actuation_map: ActuationMap, clock: Clock, side: str = "right") -> None:
        """Subscribe and advertise on `node`."""
        self._map, self._clock = actuation_map, clock
        self._lock = threading.Lock()
        self._latest: tuple[float, ActuatorStates] | None = None
        self._publisher = node.create_publisher(ActuatorControl, f"{side}/actuator_control", 10)
        node.create_subscription(ActuatorStates, f"{side}/actuator_states", self._take, 10)

    def read_codes(self) -> NDArray[np.uint16]:
        """Return the latest positions, (7,), command order.

        Raises:
            LinkTimeoutError: no state, or none within `STALE_S`.
        """
        angles = np.deg2rad(self._in_command_order(self._fresh().actuations))
        codes: NDArray[np.uint16] = self._map.saturating_codes(angles).codes
        return codes

    def command_codes(self, codes: ArrayLike) -> None:
        """Publish positions, (7,), command order."""
        message = ActuatorControl()
        degrees = np.rad2deg(self._map.angles_from_codes(np.asarray(codes)))
        message.actuation_positions = [float(degrees[channel]) for channel in WIRE_ORDER]
        self._publisher.publish(message)

    def read_currents(self) -> Floats:
        """Return the latest motor currents, (7,), A, command order; errors as `read_codes`."""
        return self._in_command_order(self._fresh().actuator_currents) * 1e-3

    def read_temperatures(self) -> Floats:
        """Return the latest temperatures, (7,), °C, command order; errors as `read_codes`."""
        return self._in_command_order(self._fresh().actuator_temperatures)

    def wait_for_state(self) -> None:
        """Return when there is a first state.

        Raises:
            LinkTimeoutError: there was none within `FIRST_STATE_S`.
        """
        deadline = Deadline.after(self._clock, FIRST_STATE_S)
        while self._latest is None:
            if deadline.expired:
                raise LinkTimeoutError(f"no actuator state in {FIRST_STATE_S} s; is the official node running?")
            self._clock.sleep_until(self._clock.now() + 0.01)

    def _take(self, message: ActuatorStates) -> None:
        with self._lock:
            self._latest = self._clock.now(), message

    def _fresh(self) -> ActuatorStates:
        with self._lock:
            latest = self._latest
        if latest is None or self._clock.now() - latest[0] > STALE_S:
            raise LinkTimeoutError(f"no actuator state within {STALE_S} s; is the official node running?")
        return latest[1]

    @staticmethod
    def _in_command_order(values: ArrayLike) -> Floats:
        ordered = np.empty(len(WIRE_ORDER))
        ordered[list(WIRE_ORDER)] = np.asarray(values, np.float64)
        return ordered


def run_on(node: Node, path: Path) -> Run:
    """Run the policy file at `path` with the parameters `side`, `seconds` and `firmware` of `node`.

    Another thread must spin the node.
    """
    side = node.declare_parameter("side", "right").value
    firmware = node.declare_parameter("firmware", "0.2.0").value
    settings = RunSettings(seconds=node.declare_parameter("seconds", 15.0).value)
    actuation_map, clock = ActuationMap.for_firmware(firmware, hand=side), WallClock()
    hand = RosHand(node, actuation_map, clock, side)
    policy = load(path)
    hand.wait_for_state()
    return run_policy(policy, hand, clock, actuation_map, settings=settings)


def main() -> None:
    """Run the policy file that is the first argument."""
    rclpy.init()
    node = Node("aero_hil_policy")
    spinning = threading.Thread(target=rclpy.spin, args=(node,), daemon=True)
    spinning.start()
    try:
        node.get_logger().info(str(run_on(node, Path(sys.argv[1]))))
    finally:
        node.destroy_node()
        rclpy.shutdown()
        spinning.join()


if __name__ == "__main__":
    main()
