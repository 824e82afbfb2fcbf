"""LeRobot 0.6.1: `torque_disabled` switches on the torque of a servo whose torque was off."""

from pathlib import Path

from feetech_robots.bus_driver import served_bus
from lerobot.motors import Motor, MotorNormMode
from lerobot.motors.feetech import FeetechMotorsBus

with served_bus(Path("tests/bus_driver/wheels.toml")) as served:
    bus = FeetechMotorsBus(served.port, {"1": Motor(1, "sts3215", MotorNormMode.DEGREES)})
    bus.connect()
    print("before:", bus.read("Torque_Enable", "1"))
    with bus.torque_disabled():
        bus.write("Homing_Offset", "1", -1000, normalize=False)
    print("after:", bus.read("Torque_Enable", "1"))
