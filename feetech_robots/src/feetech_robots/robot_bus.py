"""A robot of bus servos, put together: its mechanics in MuJoCo, its servos on a bus, and what may happen to them."""

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
"""What a servo can report at most, V, and the highest temperature that makes sense, °C."""


class BusLink(VirtualLink):
    """A master's byte stream on a servo bus."""

    def __init__(self, chain: ServoChain, baud: int) -> None:
        """Connect a master at a baud rate, bit/s."""
        port = chain.bus.connect(self.arrive)
        port.baud = baud
        super().__init__(chain.kernel, port.write, "emulated bus")


class RobotBus:
    """A robot behind its bus, at rest, powered, with torque off."""

    def __init__(self, robot: Robot, *, seed: int = 0) -> None:
        """Build it.

        Args:
            robot: from `read_robot`.
            seed: of all noise.

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
        """The mechanics: true joint angles."""
        self.chain = ServoChain(self.plant, mounted, seed=seed)
        """The servos, their bus and the clock."""

    @classmethod
    def of_file(cls, path: Path, *, seed: int = 0) -> RobotBus:
        """Build the robot of a TOML file; raises what `read_robot` does too."""
        return cls(read_robot(path), seed=seed)

    def link(self, baud: int = 1_000_000) -> BusLink:
        """Return a master's byte stream on the bus, on virtual time; `baud` in bit/s."""
        _within("a baud rate", baud, 1, 10_000_000, "bit/s")
        return BusLink(self.chain, baud)

    def wait(self, seconds: float) -> None:
        """Let virtual time pass."""
        _within("a wait", seconds, 0.0, LONGEST_S, "s")
        self.chain.clock.sleep_until(self.chain.clock.now() + seconds)

    def joint_deg(self, joint: str) -> float:
        """Return the true angle of a joint, degrees, at this instant."""
        self.chain.shafts.advance()
        return math.degrees(self.plant.joint_angles()[self._place(joint)])

    def hold(self, joint: str, angle_deg: float) -> None:
        """Let a person's hand hold a joint at an angle (degrees) whenever its servo is off."""
        place = self._place(joint)
        self.chain.shafts.advance()
        self.plant.hold(place, math.radians(angle_deg))

    def let_go(self, joint: str) -> None:
        """Take the person's hand off a joint."""
        self.chain.shafts.advance()
        self.plant.hold(self._place(joint), None)

    def silence(self, servo: int, seconds: float) -> None:
        """Let the servos of an ID hear and answer nothing for a while, as with a loose plug."""
        _within("a silence", seconds, 0.0, LONGEST_S, "s")
        for one in self._servos(servo):
            one.silent_until = self.chain.kernel.now + seconds

    def heat(self, servo: int, celsius: float) -> None:
        """Give the servos of an ID a temperature (°C)."""
        _within("a temperature", celsius, 0.0, CELSIUS, "°C")
        for one in self._servos(servo):
            one.heat_to(celsius)

    def late(self, seconds: float) -> None:
        """Let the next answers, of whatever servos, arrive this much later than they should."""
        _within("a delay", seconds, 0.0, LONGEST_S, "s")
        self.chain.bus.late_s = seconds

    def peek(self, servo: int, register: str) -> int:
        """Return what a register of the first servo of an ID holds, refreshed."""
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
        """Take the power away and give it back."""
        for one in self.chain.servos:
            one.power_up()

    def supply(self, volts: float) -> None:
        """Let all servos measure another supply (V); their motors turn as before."""
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
"""Orders that a line of text may give: word, arguments, effect and answer."""


def obey(robot: RobotBus, line: str) -> str:
    """Carry out one line, a word of `ORDERS` and what follows it; return its answer, `done` where it has none.

    Raises:
        ValueError: it is no order, or names nothing of this robot; the message says what is.
    """
    word, *rest = line.split() or [""]
    if word not in ORDERS or len(rest) != len(ORDERS[word][0].split()):
        known = "; ".join(f"{word} {rest}".strip() for word, (rest, _) in ORDERS.items())
        raise ValueError(f"{line.strip()!r} is no order; orders are: {known}")
    answer = ORDERS[word][1](robot, *rest)
    return "done" if answer is None else str(answer)
