"""The ROS 2 shell against stand-ins for `rclpy` and the official messages."""

import importlib
import sys
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest
from policies import policy

from aero import AeroHand
from aero.actuation import ActuationMap
from aero.channels import WIRE_ORDER, Channel
from aero.errors import LinkTimeoutError
from aero.policy.limits import Ending
from aero.policy.loop import run_policy
from aero.policy.running import RunSettings
from aero.safety import SafetyStopError


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
    transport = ros2.RosTransport(node, ActuationMap(), clock)
    return AeroHand(transport, clock), node, clock, transport


def test_topics_are_the_official_ones(hand):
    _, node, _, _ = hand
    assert (node.control_topic, node.state_topic) == ("right/actuator_control", "right/actuator_states")


def test_degrees_are_in_hand_order_and_codes_in_command_order(hand):
    ros_hand, node, _, _ = hand
    codes = np.zeros(7, np.uint16)
    codes[Channel.THUMB_ABDUCTION], codes[Channel.INDEX] = 65535, 32768
    ros_hand.command_codes(codes)
    degrees = node.published[-1]
    closed = np.rad2deg(ActuationMap().window_rad[:, 1])
    assert degrees[0] == pytest.approx(closed[Channel.THUMB_ABDUCTION])
    assert degrees[3] == pytest.approx(closed[Channel.INDEX] / 2, abs=0.01)
    np.testing.assert_array_equal(ros_hand.read_codes(), codes)


def test_currents_come_in_ampere_and_command_order(hand):
    ros_hand, node, _, _ = hand
    node.state([0.0] * 7, currents=[1000.0, 0, 0, -500.0, 0, 0, 0])
    currents = ros_hand.read_currents()
    assert currents[Channel.THUMB_ABDUCTION] == pytest.approx(1.0, abs=0.0033)
    assert currents[Channel.INDEX] == pytest.approx(-0.5, abs=0.0033)


def test_a_state_that_is_missing_or_old_is_no_reading(hand):
    ros_hand, node, clock, transport = hand
    with pytest.raises(LinkTimeoutError, match="official ROS 2 node"):
        ros_hand.read_codes()
    with pytest.raises(LinkTimeoutError, match="official node"):
        transport.wait_for_state()
    node.state([0.0] * 7)
    transport.wait_for_state()
    ros_hand.read_codes()
    clock.t += 0.11
    with pytest.raises(LinkTimeoutError):
        ros_hand.read_temperatures()


class LiveNode(FakeNode):
    """A hand that follows at once and publishes its state a hundred times a second, currents never quite still."""

    def __init__(self, clock):
        super().__init__()
        self.clock, self.degrees, self.count, self.amperes = clock, [0.0] * 7, 0, 0.1
        clock.on_time = self.tick

    def publish(self, message):
        self.published.append(message.actuation_positions)
        self.degrees = message.actuation_positions

    def tick(self):
        self.count += 1
        self.state(self.degrees, [1000 * self.amperes + 6.5 * (self.count % 7)] * 7)


class TickingClock(StepClock):
    on_time = staticmethod(lambda: None)

    def sleep_until(self, t):
        while self.t < t:
            self.t = min(t, self.t + 0.01)
            self.on_time()


@pytest.fixture
def live(ros2):
    clock = TickingClock()
    node = LiveNode(clock)
    codec = ActuationMap()
    transport = ros2.RosTransport(node, codec, clock)
    node.tick()
    return ros2.guarded(transport, clock, codec), node, codec


def assert_open(node):
    """All channels were last told to go to the open ends of their windows."""
    ends = np.rad2deg(ActuationMap().window_rad[:, 0])
    np.testing.assert_allclose(node.degrees, ends[list(WIRE_ORDER)], atol=0.01)


def test_the_loop_runs_over_it(live):
    hand, node, codec = live
    settings = RunSettings(seconds=0.5, approach_s=0.2, wait_s=0.05)
    with hand:
        run = run_policy(policy(), hand, hand.clock, codec, settings=settings)
    assert (run.ending, run.steps) == (Ending.TIME, 10)
    assert_open(node)


def test_it_is_stopped_as_any_other_hand_and_left_open(live):
    hand, node, _ = live
    with hand:
        hand.command_codes([30000] * 7)
        node.amperes = 4.5
        with pytest.raises(SafetyStopError, match="4 A"):
            hand.clock.sleep_until(hand.clock.now() + 1.0)
    assert_open(node)


def test_ctrl_c_leaves_it_open(live):
    hand, node, _ = live

    def program():
        with hand:
            hand.command_codes([30000] * 7)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        program()
    assert_open(node)
