"""A policy on a hand behind the official ROS 2 node: the same guarded hand and loop. Imports `rclpy`.

    python -m aero.policy.ros2 POLICY --ros-args -p seconds:=15.0

Start the official node with `control_space:=actuator`, else it does not listen to the topic written here. Topics and
messages are those of `aero_hand_open_msgs`: `right/actuator_states` in, `right/actuator_control` out, both in degrees
of the shafts in hand order (which is the wire order).
"""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable
from pathlib import Path

import numpy as np
import rclpy
from aero_hand_open_msgs.msg import ActuatorControl, ActuatorStates
from numpy.typing import ArrayLike, NDArray
from rclpy.node import Node

from aero.actuation import ActuationMap
from aero.channels import WIRE_ORDER
from aero.clock import Clock, Deadline, WallClock
from aero.driver import CURRENT_A_PER_UNIT
from aero.errors import LinkTimeoutError
from aero.firmware import DEFAULT_FIRMWARE
from aero.policy.file import load
from aero.policy.loop import run_policy
from aero.policy.running import Run, RunSettings
from aero.protocol import FRAME_SIZE, Opcode, make_reply, parse_reply, unsigned_values
from aero.safety import GuardedHand, unwinding

STALE_S = 0.1
"""Age from which a state counts as missing, s; the official node publishes a hundred a second."""
FIRST_STATE_S = 5.0
"""Patience for the first state, s."""

Floats = NDArray[np.float64]


class RosTransport:
    """A hand behind the official node as the driver's `Transport`: frames in, frames out, as if it were the board.

    So the guard watches it as any other. A state that is missing or old is a reading that is not answered. The lock
    covers the latest state, which the executor's thread writes and the loop's thread reads.
    """

    def __init__(self, node: Node, actuation_map: ActuationMap, clock: Clock, side: str = "right") -> None:
        """Subscribe and advertise on `node`."""
        self._map, self._clock = actuation_map, clock
        self._lock = threading.Lock()
        self._latest: tuple[float, ActuatorStates] | None = None
        self._incoming, self._outgoing = bytearray(), bytearray()
        self._publisher = node.create_publisher(ActuatorControl, f"{side}/actuator_control", 10)
        node.create_subscription(ActuatorStates, f"{side}/actuator_states", self._take, 10)

    @property
    def name(self) -> str:
        """What messages call it."""
        return "the official ROS 2 node"

    def write(self, data: bytes) -> None:
        """Publish a position command, or get the answer to a query ready; what the node cannot do stays unanswered."""
        self._incoming += data
        while len(self._incoming) >= FRAME_SIZE:
            frame = parse_reply(bytes(self._incoming[:FRAME_SIZE]))
            del self._incoming[:FRAME_SIZE]
            if frame.opcode == Opcode.CTRL_POS:
                self._publish(unsigned_values(frame))
            elif frame.opcode in _ANSWERS and (state := self._fresh()) is not None:
                self._outgoing += make_reply(Opcode(frame.opcode), _ANSWERS[frame.opcode](self._map, state))

    def read(self, size: int, timeout: float) -> bytes:
        """Return what is there, at the latest after `timeout` (s)."""
        if len(self._outgoing) < size:
            self._clock.sleep_until(self._clock.now() + timeout)
        data = bytes(self._outgoing[:size])
        del self._outgoing[:size]
        return data

    def discard_input(self) -> None:
        """Drop what has not been read."""
        self._outgoing.clear()

    def close(self) -> None:
        """Do nothing: the node is its owner's."""

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

    def _publish(self, codes: NDArray[np.uint16]) -> None:
        message = ActuatorControl()
        degrees = np.rad2deg(self._map.angles_from_codes(codes))
        message.actuation_positions = [float(degrees[channel]) for channel in WIRE_ORDER]
        self._publisher.publish(message)

    def _take(self, message: ActuatorStates) -> None:
        with self._lock:
            self._latest = self._clock.now(), message

    def _fresh(self) -> ActuatorStates | None:
        with self._lock:
            latest = self._latest
        return None if latest is None or self._clock.now() - latest[0] > STALE_S else latest[1]


def _codes(actuation_map: ActuationMap, state: ActuatorStates) -> ArrayLike:
    codes: NDArray[np.uint16] = actuation_map.saturating_codes(np.deg2rad(in_command_order(state.actuations))).codes
    return codes


_ANSWERS: dict[int, Callable[[ActuationMap, ActuatorStates], ArrayLike]] = {
    Opcode.GET_POS: _codes,
    Opcode.GET_CURR: lambda _, state: in_command_order(state.actuator_currents) * 1e-3 / CURRENT_A_PER_UNIT,
    Opcode.GET_TEMP: lambda _, state: in_command_order(state.actuator_temperatures),
}
"""What makes the seven values of a reply of a state, command order; the node's are °, mA and °C."""


def in_command_order(values: ArrayLike) -> Floats:
    """Return values in hand order, (7,), in command order."""
    ordered = np.empty(len(WIRE_ORDER))
    ordered[list(WIRE_ORDER)] = np.asarray(values, np.float64)
    return ordered


def run_on(node: Node, path: Path) -> Run:
    """Run the policy file at `path` with the parameters `side`, `seconds` and `firmware` of `node`.

    Another thread must spin the node.
    """
    side = node.declare_parameter("side", "right").value
    firmware = node.declare_parameter("firmware", DEFAULT_FIRMWARE).value
    settings = RunSettings(seconds=node.declare_parameter("seconds", 15.0).value)
    actuation_map, clock = ActuationMap.for_firmware(firmware, hand=side), WallClock()
    transport = RosTransport(node, actuation_map, clock, side)
    policy = load(path)
    transport.wait_for_state()
    with unwinding(), guarded(transport, clock, actuation_map) as hand:
        return run_policy(policy, hand, hand.clock, actuation_map, settings=settings)


def guarded(transport: RosTransport, clock: Clock, actuation_map: ActuationMap) -> GuardedHand:
    """Return the hand behind the node, watched, and left open at the end.

    The node has no way to set limits, so it is neither moved nor left with less torque than the node's own; and a
    killed program is not made up for, because only the node has the port.
    """
    return GuardedHand(transport, clock, spans_counts=actuation_map.window.spans_counts(), usual=None)


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
