"""LeRobot's `FeetechMotorsBus`, 0.6."""

from collections.abc import Mapping, Sequence

from lerobot.motors import Motor, MotorNormMode
from lerobot.motors.feetech import FeetechMotorsBus

NAMES = {
    "offset": "Homing_Offset",
    "goal_position": "Goal_Position",
    "goal_speed": "Goal_Velocity",
    "present_position": "Present_Position",
    "present_speed": "Present_Velocity",
    "present_load": "Present_Load",
    "present_voltage": "Present_Voltage",
}


class Driver:
    """`feetech_robots.bus_driver.BusDriver`."""

    def __init__(self, port: str, servos: Mapping[int, str]) -> None:
        scs = any(model.startswith("SCS") for model in servos.values())
        motors = {f"{servo}": Motor(servo, model.lower(), MotorNormMode.DEGREES) for servo, model in servos.items()}
        self._bus = FeetechMotorsBus(port, motors, protocol_version=int(scs))
        self._bus.connect(handshake=False)

    def read(self, servo: int, register: str) -> int:
        """Read without normalising."""
        return int(self._bus.read(NAMES[register], f"{servo}", normalize=False))

    def write(self, servo: int, register: str, value: int) -> None:
        """Write without normalising."""
        self._bus.write(NAMES[register], f"{servo}", value, normalize=False)

    def sync_read(self, register: str, servos: Sequence[int]) -> dict[int, int | None]:
        """Read without normalising."""
        found = self._bus.sync_read(NAMES[register], [f"{servo}" for servo in servos], normalize=False)
        return {int(name): int(value) for name, value in found.items()}

    def sync_write(self, register: str, values: Mapping[int, int]) -> None:
        """Write without normalising."""
        self._bus.sync_write(NAMES[register], {f"{servo}": value for servo, value in values.items()}, normalize=False)

    def store(self, servo: int, register: str, value: int) -> None:
        """Write with the torque disabled, as LeRobot's robots do."""
        with self._bus.torque_disabled([f"{servo}"]):
            self.write(servo, register, value)

    def middle(self, servo: int) -> None:
        """Set the offset by `set_half_turn_homings`."""
        self._bus.set_half_turn_homings([f"{servo}"])

    def close(self) -> None:
        """Close the port and leave the torque."""
        self._bus.disconnect(disable_torque=False)
