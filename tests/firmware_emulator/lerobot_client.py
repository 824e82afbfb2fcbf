"""Scans and drives servos with LeRobot 0.4.4's `FeetechMotorsBus`; `python lerobot_client.py PORT` with it on the path.

LeRobot's package is used as it was published. It imports torch, accelerate and datasets for other purposes than motors;
they are stood in for.
"""

import sys
from unittest.mock import MagicMock

for name in ("torch", "accelerate", "datasets", "datasets.utils", "datasets.utils.logging"):
    sys.modules[name] = MagicMock()

from lerobot.motors import Motor, MotorNormMode  # noqa: E402
from lerobot.motors.feetech import FeetechMotorsBus  # noqa: E402

port = sys.argv[1]
found = FeetechMotorsBus.scan_port(port)
# It waits 50 ms for each model number, so that a loaded machine may cost it some.
assert list(found) == [1_000_000], found
assert set(found[1_000_000]) <= set(range(6)), found
motors = {f"motor{servo}": Motor(servo, "sts3215", MotorNormMode.RANGE_M100_100) for servo in range(6)}
bus = FeetechMotorsBus(port, motors)
bus.connect()
assert bus.is_connected
positions = bus.sync_read("Present_Position", normalize=False)
assert 3270 <= positions["motor3"] <= 3285, positions
bus.write("Homing_Offset", "motor3", -1000, normalize=False)
assert bus.read("Homing_Offset", "motor3", normalize=False) == -1000
bus.disconnect()
print("done")
