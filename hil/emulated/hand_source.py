"""Source of the page's frames: the true posture and cables of an emulated hand in this process."""

import numpy as np

from aero.actuation import ActuationMap
from aero.channels import WIRE_ORDER, Channel
from aero.protocol import MAX_CODE
from firmware_emulator.firmware.hands import SHAFT_OF_SERVO
from firmware_emulator.hand import EmulatedHand
from firmware_emulator.servo import control
from firmware_emulator.servo.parameters import CURRENT_UNIT_MA
from hil.view.frame import ViewFrame, unknown
from hil.view.sources import posture, within_stops
from model import BuiltHandPlant


class EmulatedSource:
    """Emulated hand in this process: true posture and cables, and the servos' registers."""

    def __init__(self, electronics: EmulatedHand, plant: BuiltHandPlant, codec: ActuationMap) -> None:
        self._electronics, self._plant, self._codec = electronics, plant, codec

    def frame(self) -> ViewFrame:
        """Return the present frame."""
        seen = self._plant.glimpse()
        commanded, measured, currents, temperatures = (unknown() for _ in range(4))
        for i, servo in enumerate(self._electronics.servos):
            registers, angle, shaft = servo.memory, servo.frame.angle, SHAFT_OF_SERVO[i]
            if registers.get("torque_enable") == control.ON and registers.get("mode") == control.POSITION:
                commanded[shaft] = angle(registers.get("goal_position"))
            measured[shaft] = angle(registers.get("present_position"))
            currents[shaft] = abs(registers.get("present_current")) * CURRENT_UNIT_MA / 1000.0
            temperatures[shaft] = registers.get("present_temperature")
        # Seven cables do not determine sixteen joints, so the map's change from measured to commanded angles is added
        # to the true posture.
        joints = seen.joints + posture(self._codec, commanded) - posture(self._codec, measured)
        words = self._electronics.commanded_words()
        percent = np.array([words[WIRE_ORDER.index(channel)] for channel in Channel]) * (100.0 / MAX_CODE)
        numbers = commanded, measured, percent, currents, temperatures, seen.tensions, seen.loose
        return ViewFrame(seen.time, seen.joints, within_stops(joints), *numbers)
