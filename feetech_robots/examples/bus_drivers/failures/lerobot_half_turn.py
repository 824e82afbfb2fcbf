"""LeRobot 0.6.1: a servo that reads 4095 has no half-turn homing; the offset would be 2048."""

from pathlib import Path

from feetech_robots.bus_driver import served_bus
from lerobot.motors import Motor, MotorNormMode
from lerobot.motors.feetech import FeetechMotorsBus

with served_bus(Path("tests/bus_driver/wheels.toml")) as served:
    bus = FeetechMotorsBus(served.port, {"1": Motor(1, "sts3215", MotorNormMode.DEGREES)})
    bus.connect()
    served.order("hold", "first", (4095 - 1000) * 360 / 4096)
    served.pass_time(1.5)
    print(bus.read("Present_Position", "1", normalize=False))
    bus.set_half_turn_homings()
