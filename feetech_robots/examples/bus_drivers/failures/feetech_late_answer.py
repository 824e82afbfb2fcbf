"""feetech-servo-sdk 1.0.0: after one late answer, every read returns the answer to the one before."""

from pathlib import Path

import scservo_sdk as sdk
from feetech_robots.bus_driver import served_bus

with served_bus(Path("tests/bus_driver/wheels.toml")) as bus:
    port, packets = sdk.PortHandler(bus.port), sdk.PacketHandler(0)
    port.setBaudRate(1_000_000)
    bus.order("poke", 1, "goal_position", 1111)
    bus.order("poke", 1, "goal_speed", 222)
    bus.order("late", 0.2)
    print("result of the late read:", packets.read2ByteTxRx(port, 1, 42)[1])
    bus.pass_time(0.4)
    for _ in range(3):
        print("goal speed, 222:", packets.read2ByteTxRx(port, 1, 46)[0])
        print("goal position, 1111:", packets.read2ByteTxRx(port, 1, 42)[0])
