"""The ROS 2 shell against stand-ins for `rclpy` and the official messages."""

import importlib
import sys
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest
from policies import policy

from aero.actuation import ActuationMap
from aero.channels import Channel
from aero.errors import LinkTimeoutError
from aero.policy.limits import Ending
from aero.policy.loop import run_policy
from aero.policy.running import RunSettings


class FakeNode:
    """Connects publisher and subscriber: a hand that is at once where it is told to be."""

    def __init__(self, *_):
        self.published = []

    def create_publisher(self, kind, topic, depth):
        self.control_topic = topic
        return SimpleNamespace(publish=self.publish)

    def create_subscription(self, kind, topic, callback, depth):
        self.state_topic, self.callback = topic, callback

    def publish(self, message):
        self.published.append(message.actuation_positions)
        self.state(message.actuation_positions)

    def state(self, degrees, currents=(0.0,) * 7):
        self.callback(SimpleNamespace(actuations=degrees, actuator_currents=currents, actuator_temperatures=[30.0] * 7))


class StepClock:
    t = 0.0

    def now(self):
        return self.t

    def sleep_until(self, t):
        self.t = max(self.t, t)


@pytest.fixture
def ros2(monkeypatch):
    rclpy, node, package, messages = map(
        ModuleType, ("rclpy", "rclpy.node", "aero_hand_open_msgs", "aero_hand_open_msgs.msg")
    )
    node.Node = FakeNode
    messages.ActuatorControl = messages.ActuatorStates = SimpleNamespace
    for module in (rclpy, node, package, messages):
        monkeypatch.setitem(sys.modules, module.__name__, module)
    monkeypatch.delitem(sys.modules, "aero.policy.ros2", raising=False)
    yield importlib.import_module("aero.policy.ros2")
    sys.modules.pop("aero.policy.ros2", None)


@pytest.fixture
def hand(ros2):
    node, clock = FakeNode(), StepClock()
    return ros2.RosHand(node, ActuationMap(), clock), node, clock


def test_topics_are_the_official_ones(hand):
    _, node, _ = hand
    assert (node.control_topic, node.state_topic) == ("right/actuator_control", "right/actuator_states")


def test_degrees_are_in_hand_order_and_codes_in_command_order(hand):
    ros_hand, node, _ = hand
    codes = np.zeros(7, np.uint16)
    codes[Channel.THUMB_ABDUCTION], codes[Channel.INDEX] = 65535, 32768
    ros_hand.command_codes(codes)
    degrees = node.published[-1]
    closed = np.rad2deg(ActuationMap().window_rad[:, 1])
    assert degrees[0] == pytest.approx(closed[Channel.THUMB_ABDUCTION])
    assert degrees[3] == pytest.approx(closed[Channel.INDEX] / 2, abs=0.01)
    np.testing.assert_array_equal(ros_hand.read_codes(), codes)


def test_currents_come_in_ampere_and_command_order(hand):
    ros_hand, node, _ = hand
    node.state([0.0] * 7, currents=[1000.0, 0, 0, -500.0, 0, 0, 0])
    currents = ros_hand.read_currents()
    assert currents[Channel.THUMB_ABDUCTION] == 1.0
    assert currents[Channel.INDEX] == -0.5


def test_a_state_that_is_missing_or_old_is_no_reading(hand):
    ros_hand, node, clock = hand
    with pytest.raises(LinkTimeoutError, match="official node"):
        ros_hand.read_codes()
    with pytest.raises(LinkTimeoutError, match="official node"):
        ros_hand.wait_for_state()
    node.state([0.0] * 7)
    ros_hand.wait_for_state()
    ros_hand.read_codes()
    clock.t += 0.11
    with pytest.raises(LinkTimeoutError):
        ros_hand.read_temperatures()


def test_the_loop_runs_over_it(hand):
    ros_hand, node, clock = hand
    node.state([0.0] * 7)
    settings = RunSettings(seconds=0.5, approach_s=0.2, wait_s=0.05)
    run = run_policy(policy(), ros_hand, clock, ActuationMap(), settings=settings)
    assert (run.ending, run.steps) == (Ending.TIME, 10)
