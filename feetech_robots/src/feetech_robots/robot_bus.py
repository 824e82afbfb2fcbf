"""Emulated robot of bus servos: mechanics in MuJoCo, servos on a bus, and injected disturbances."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

from feetech_robots.joint_plant import GearedShaft, JointPlant
from feetech_robots.robot_file import Robot, read_robot
from firmware_emulator.links.in_process import VirtualLink
from firmware_emulator.servo.frame import Mounting
from firmware_emulator.servo.memory import encode_signed
from firmware_emulator.servo.model_file import Register
from firmware_emulator.servo.servo import Servo
from firmware_emulator.servo_chain import MountedServo, ServoChain

LONGEST_S = 3600.0
VOLTS, CELSIUS = 25.5, 150.0
"""Largest voltage that a servo can report, V, and largest accepted temperature, °C."""


class BusLink(VirtualLink):
    """Byte stream of a master on a servo bus."""

    def __init__(self, chain: ServoChain, baud: int) -> None:
        """Connect a master at a baud rate, bit/s."""
        port = chain.bus.connect(self.arrive)
        port.baud = baud
        super().__init__(chain.kernel, port.write, "emulated bus")


class RobotBus:
    """Robot on a servo bus, initially at rest and powered, with torque off."""

    def __init__(self, robot: Robot, *, seed: int = 0) -> None:
        """Build mechanics and servos of a robot.

        Args:
            robot: from `read_robot`.
            seed: seed of all noise.

        Raises:
            ValueError: the mechanics do not fit the servos.
            OSError: the MJCF file cannot be read.
        """
        parameters = [servo.parameters for servo in robot.servos]
        shafts = [
            GearedShaft(servo.joint, own.back_emf, servo.gear, math.radians(servo.start_deg), servo.joint_damping)
            for servo, own in zip(robot.servos, parameters, strict=True)
        ]
        mounted = [
            MountedServo(servo.id, Mounting(place, servo.direction, servo.zero_counts), own)
            for place, (servo, own) in enumerate(zip(robot.servos, parameters, strict=True))
        ]
        self.robot = robot
        self.plant = JointPlant(robot.mjcf, shafts)
        """Mechanics, with the true joint angles."""
        self.chain = ServoChain(self.plant, mounted, seed=seed)
        """Servos, bus and clock."""

    @classmethod
    def of_file(cls, path: Path, *, seed: int = 0) -> RobotBus:
        """Build the robot of a TOML file; also raises the errors of `read_robot`."""
        return cls(read_robot(path), seed=seed)

    def link(self, baud: int = 1_000_000) -> BusLink:
        """Return a new master's byte stream on the bus, in virtual time; `baud` in bit/s."""
        _within("a baud rate", baud, 1, 10_000_000, "bit/s")
        return BusLink(self.chain, baud)

    def wait(self, seconds: float) -> None:
        """Advance virtual time by `seconds`."""
        _within("a wait", seconds, 0.0, LONGEST_S, "s")
        self.chain.clock.sleep_until(self.chain.clock.now() + seconds)

    def joint_deg(self, joint: str) -> float:
        """Return the present true angle of a joint, degrees."""
        self.chain.shafts.advance()
        return math.degrees(self.plant.joint_angles()[self._place(joint)])

    def hold(self, joint: str, angle_deg: float) -> None:
        """Hold a joint at an angle (degrees), like a human hand, whenever its servo is off."""
        place = self._place(joint)
        self.chain.shafts.advance()
        self.plant.hold(place, math.radians(angle_deg))

    def let_go(self, joint: str) -> None:
        """Release a joint held by `hold`."""
        self.chain.shafts.advance()
        self.plant.hold(self._place(joint), None)

    def silence(self, servo: int, seconds: float) -> None:
        """Disconnect the servos of an ID from the bus for some seconds, as with a loose plug."""
        _within("a silence", seconds, 0.0, LONGEST_S, "s")
        for one in self._servos(servo):
            one.silent_until = self.chain.kernel.now + seconds

    def heat(self, servo: int, celsius: float) -> None:
        """Set the temperature (°C) of the servos of an ID."""
        _within("a temperature", celsius, 0.0, CELSIUS, "°C")
        for one in self._servos(servo):
            one.heat_to(celsius)

    def late(self, seconds: float) -> None:
        """Delay the next train of answers by `seconds`."""
        _within("a delay", seconds, 0.0, LONGEST_S, "s")
        self.chain.bus.late_s = seconds

    def peek(self, servo: int, register: str) -> int:
        """Return a register's refreshed value, from the first servo of an ID."""
        one = self._servos(servo)[0]
        row = self._register(one, register)
        one.read(row.address, row.size)
        return one.memory.get(register)

    def poke(self, servo: int, register: str, value: int) -> None:
        """Write a register of all servos of an ID, as over the bus."""
        for one in self._servos(servo):
            row = self._register(one, register)
            if not row.sign_bit:
                _within(f"register {register}", value, 0, (1 << 8 * row.size) - 1, row.unit or "as a number")
            word = encode_signed(value, row.sign_bit) if row.sign_bit else value
            one.write(row.address, word.to_bytes(row.size, one.model.byte_order))

    def power_cycle(self) -> None:
        """Power all servos off and on."""
        for one in self.chain.servos:
            one.power_up()

    def supply(self, volts: float) -> None:
        """Set the supply voltage (V) that all servos measure, without an effect on the motors."""
        _within("a supply", volts, 0.0, VOLTS, "V")
        self.chain.supply(volts)

    def _place(self, joint: str) -> int:
        joints = self.robot.joints()
        if joint not in joints:
            raise ValueError(f"no joint {joint!r}; it has {', '.join(joints)}")
        return joints[joint]

    def _register(self, servo: Servo, name: str) -> Register:
        if name not in servo.model.registers:
            raise ValueError(
                f"no register {name!r} in an {servo.model.name}; it has {', '.join(servo.model.registers)}"
            )
        return servo.model.registers[name]

    def _servos(self, number: int) -> list[Servo]:
        found = [servo for servo in self.chain.servos if servo.id == number]
        if not found:
            raise ValueError(f"no servo with ID {number}; it has {', '.join(str(one.id) for one in self.chain.servos)}")
        return found


def _within(what: str, value: float, low: float, high: float, unit: str) -> None:
    if not low <= value <= high:
        raise ValueError(f"{what} is {low:g} to {high:g} {unit}, not {value:g}")


ORDERS: dict[str, tuple[str, Callable[..., object]]] = {
    "hold": ("JOINT DEGREES", lambda robot, joint, angle: robot.hold(joint, float(angle))),
    "let_go": ("JOINT", lambda robot, joint: robot.let_go(joint)),
    "silence": ("ID SECONDS", lambda robot, servo, seconds: robot.silence(int(servo), float(seconds))),
    "late": ("SECONDS", lambda robot, seconds: robot.late(float(seconds))),
    "heat": ("ID CELSIUS", lambda robot, servo, celsius: robot.heat(int(servo), float(celsius))),
    "supply": ("VOLTS", lambda robot, volts: robot.supply(float(volts))),
    "power_cycle": ("", lambda robot: robot.power_cycle()),
    "peek": ("ID REGISTER", lambda robot, servo, name: robot.peek(int(servo), name)),
    "poke": ("ID REGISTER VALUE", lambda robot, servo, name, value: robot.poke(int(servo), name, int(value))),
    "now": ("", lambda robot: robot.chain.clock.now()),
}
"""Text orders: word, arguments, and function that executes the order and returns its answer."""


def obey(robot: RobotBus, line: str) -> str:
    """Execute one order, a word of `ORDERS` with arguments; return its answer, or `done` without one.

    Raises:
        ValueError: an unknown order, or an unknown joint, servo or register; the message lists the valid ones.
    """
    word, *rest = line.split() or [""]
    if word not in ORDERS or len(rest) != len(ORDERS[word][0].split()):
        known = "; ".join(f"{word} {rest}".strip() for word, (rest, _) in ORDERS.items())
        raise ValueError(f"{line.strip()!r} is not an order; orders are: {known}")
    answer = ORDERS[word][1](robot, *rest)
    return "done" if answer is None else str(answer)
