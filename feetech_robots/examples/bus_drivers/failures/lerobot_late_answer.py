"""LeRobot 0.6.1: after one late sync read, every sync read returns the answers to the one before."""

from pathlib import Path

from feetech_robots.bus_driver import served_bus
from lerobot.motors import Motor, MotorNormMode
from lerobot.motors.feetech import FeetechMotorsBus

with served_bus(Path("tests/bus_driver/wheels.toml")) as served:
    bus = FeetechMotorsBus(served.port, {f"{n}": Motor(n, "sts3215", MotorNormMode.DEGREES) for n in (1, 2, 3)})
    bus.connect()
    served.order("late", 0.2)
    try:
        bus.sync_read("Present_Position", normalize=False)
    except ConnectionError as error:
        print(error)
    served.pass_time(0.4)
    for name in ("Goal_Velocity", "Present_Voltage", "Present_Position"):
        print(name, bus.sync_read(name, normalize=False))
