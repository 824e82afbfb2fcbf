"""Emulated hands behind a guard, healthy or with the faults that a guard detects."""

import dataclasses
from contextlib import contextmanager

import numpy as np

from aero.protocol import MAX_CODE
from firmware_emulator.links.in_process import InProcessLink
from hil.emulated.any_hand import EmulatedOpening, in_process
from hil.emulated.emulated_hand import build_emulated
from hil.emulated.emulated_spec import EmulatedSpec
from model.units import load_unit


class Tampered:
    """Plant with a servo that differs from the driver's assumptions."""

    def __init__(self, plant, shaft, change):
        """Wrap a plant; `change` maps the requested drive of a servo to the applied one."""
        self._plant, self._shaft, self._change = plant, shaft, change
        self._asked = None

    def __getattr__(self, name):
        return getattr(self._plant, name)

    def drive(self, shaft, drive):
        if shaft == self._shaft:
            self._asked, drive = drive, self._change(drive)
        self._plant.drive(shaft, drive)

    def set_setpoint(self, shaft, setpoint):
        if shaft == self._shaft and self._asked is not None:
            self.drive(shaft, dataclasses.replace(self._asked, setpoint=setpoint))
        elif shaft != self._shaft:
            self._plant.set_setpoint(shaft, setpoint)


class FailingLink(InProcessLink):
    """Link that can be cut: replies are lost, or the port is gone."""

    silent = unplugged = False

    def read(self, size, timeout):
        data = super().read(size, timeout)
        return b"" if self.silent else data

    def write(self, data):
        if self.unplugged:
            raise ConnectionError("cannot write to the hand: has it been unplugged?")
        super().write(data)


@contextmanager
def guarded(*, firmware="0.2.0", rewire=None, thresholds=None, link=InProcessLink, servos=None):
    """Yield a guarded target on the reference unit, with changed `servos` parameters."""
    unit = load_unit("reference")
    unit = dataclasses.replace(unit, servos=dataclasses.replace(unit.servos, **(servos or {})))
    spec = EmulatedSpec(firmware=firmware, seed=3, guarded=True, thresholds=thresholds)
    electronics, workbench = build_emulated(unit, spec, rewire=rewire)
    with in_process(EmulatedOpening(spec, unit=unit), workbench, link(electronics)) as target:
        yield target


def wait(target, seconds):
    target.clock.sleep_until(target.clock.now() + seconds)


def close(target, *channels, share=1.0):
    codes = np.zeros(7, int)
    codes[list(channels)] = round(share * MAX_CODE)
    target.hand.command_codes(codes)


def torque_limits(target):
    """Return the torque limits of the servos, register units, in wire order."""
    return [servo.memory.get("goal_torque") for servo in target.truth.electronics.servos]


class BusyHost(InProcessLink):
    """Link of a busy host: replies are read up to 0.1 s late, lost, or read after a pause.

    The values keep their true age; only the program receives them late.
    """

    LATE_S, PAUSE_S = 0.1, 0.5
    late = lost = paused = 0.0
    """Fractions of late replies."""

    def __init__(self, electronics, seed=0):
        super().__init__(electronics)
        self.clock, self.random = electronics.clock, np.random.default_rng(seed)

    def read(self, size, timeout):
        data = super().read(size, timeout)
        if len(data) < 16:
            return data
        fate, share = self.random.uniform(size=2)
        if fate < self.lost:
            self.clock.sleep_until(self.clock.now() + timeout)
            return b""
        if fate < self.lost + self.late:
            self.clock.sleep_until(self.clock.now() + share * self.LATE_S)
        elif fate < self.lost + self.late + self.paused:
            self.clock.sleep_until(self.clock.now() + share * self.PAUSE_S)
        return data


def four_fingers_at_full_speed(target, seconds):
    """Close and open all fingers at full speed, half a second in each direction."""
    codes = np.zeros(7, int)
    until = target.clock.now() + seconds
    while target.clock.now() < until:
        codes[:4] = MAX_CODE - codes[:4]
        target.hand.command_codes(codes)
        wait(target, 0.5)
