"""ftservo-python-sdk 2.0.1: `WritePosEx` sends a negative goal as two's complement; the servo means another."""

from pathlib import Path

import scservo_sdk as sdk
from feetech_robots.bus_driver import served_bus

with served_bus(Path("tests/bus_driver/wheels.toml")) as bus:
    port = sdk.PortHandler(bus.port)
    port.openPort()
    port.setBaudRate(1_000_000)
    servos = sdk.sms_sts(port)
    bus.order("poke", 1, "phase", 28)
    print("written:", servos.WritePosEx(1, -500, 0, 0))
    print("the servo's goal:", bus.peek(1, "goal_position"))
