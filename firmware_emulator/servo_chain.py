"""Servos on one bus with any plant, on one clock."""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

from firmware_emulator.bus import ServoBus
from firmware_emulator.kernel import Kernel, Task, VirtualClock
from firmware_emulator.plant import Plant
from firmware_emulator.servo.frame import Mounting
from firmware_emulator.servo.parameters import ServoParameters
from firmware_emulator.servo.servo import Servo
from firmware_emulator.servo.shafts import Shafts

HOUSEKEEPING_S = 0.1
"""Update period of the servos' temperatures and protections, s."""


class MountedServo(NamedTuple):
    """One servo of a chain."""

    id: int
    """Bus ID; duplicates are allowed."""
    mounting: Mounting
    parameters: ServoParameters
    """Servo model and physical parameters."""


class ServoChain:
    """Powered servos with their torque off, at time zero."""

    def __init__(self, plant: Plant, servos: Sequence[MountedServo], *, seed: int = 0) -> None:
        """Mount servos on a plant at time zero; the first servo sets the loop and turnaround times of all.

        Args:
            plant: mechanics driven by the servos.
            servos: servos to mount, in the order of `self.servos`.
            seed: seed of all noise.

        Raises:
            ValueError: `servos` is empty.
        """
        if not servos:
            raise ValueError("a chain has at least one servo")
        first = servos[0].parameters
        self.kernel = Kernel()
        self.clock = VirtualClock(self.kernel)
        self.shafts = Shafts(
            self.kernel, plant, loop_period_s=first.loop_period_s, refresh_period_s=first.refresh_period_s
        )
        self.servos = [Servo(*servo, self.kernel, self.shafts, seed=seed) for servo in servos]
        self.bus = ServoBus(self.kernel, self.servos, first.turnaround_s)
        self.kernel.spawn(self._look_after_servos())

    def supply(self, volts: float) -> None:
        """Set the supply voltage (V) that the servos measure; the effect on the motors is up to the plant."""
        for servo in self.servos:
            servo.feedback.volts = volts

    def retime(self, parameters: ServoParameters) -> None:
        """Apply the goal delay and turnaround time of `parameters` to all servos."""
        for servo in self.servos:
            servo.parameters = replace(servo.parameters, goal_delay_s=parameters.goal_delay_s)
        self.bus.turnaround_s = parameters.turnaround_s

    def _look_after_servos(self) -> Task:
        while True:
            yield self.kernel.now + HOUSEKEEPING_S
            for servo in self.servos:
                servo.look_after(HOUSEKEEPING_S)
