"""A guarded port with a scripted client in virtual time: bytes at given times, then an end."""

import math
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from aero.actuation import CommandWindow
from aero.firmware import firmware_of
from aero.protocol import MAX_CODE, make_positions
from aero.safety import Thresholds
from aero.safety.port_guard import GuardedKind, PortGuard, PortState
from firmware_emulator.links.in_process import InProcessLink
from hil.emulated.emulated_hand import build_emulated
from hil.emulated.emulated_spec import EmulatedSpec
from model.units import load_unit

FIST = make_positions([MAX_CODE] * 4 + [0, 0, 0])


@dataclass
class ScriptedLine:
    """Line between a scripted client and an emulated hand, on virtual time."""

    link: InProcessLink
    clock: object
    script: list[tuple[float, bytes]] = field(default_factory=list)
    """Bytes of the client, by clock s, in order."""
    present: tuple[float, float] = (0.0, math.inf)
    """Time in which the client has the port open, clock s."""
    unplugged: tuple[float, float] = (math.inf, math.inf)
    """Time in which the port is gone, clock s."""
    received: bytearray = field(default_factory=bytearray)
    """Bytes for the client."""

    def wait(self, longest_s):
        self._check()
        now = self.clock.now()
        due = self.script[0][0] if self.script else math.inf
        data = self.link.read(1, max(0.0, min(longest_s, due - now)))
        data += self.link.read(4096, 0.0)
        client = b""
        while self.script and self.script[0][0] <= self.clock.now():
            client += self.script.pop(0)[1]
        return client, data

    def to_port(self, data):
        self._check()
        self.link.write(data)

    def to_client(self, data):
        self.received += data

    def has_client(self):
        return self.present[0] <= self.clock.now() < self.present[1]

    def close(self):
        pass

    def connect(self):
        self._check()
        return self

    def _check(self):
        if self.unplugged[0] <= self.clock.now() < self.unplugged[1]:
            raise ConnectionError("unplugged")


class Found(NamedTuple):
    """Hand behind a guard that still runs."""

    state: PortState
    bend_deg: float
    """Largest joint angle, by the mechanics."""
    torque: int
    """Largest torque limit of a servo, register units."""


@dataclass
class Guarded:
    line: ScriptedLine
    guard: PortGuard
    electronics: object
    workbench: object
    stops: list = field(default_factory=list)
    said: list = field(default_factory=list)

    def run(self, seconds):
        """Run the guard for a time, and return state and bend before its own end, which would open the hand."""
        until, found = self.line.clock.now() + seconds, []

        def over():
            if self.line.clock.now() < until:
                return False
            self.electronics.advance_plant()
            angles = np.rad2deg(self.workbench.mechanics.joint_angles())
            limits = {servo.memory.get("goal_torque") for servo in self.electronics.servos}
            found.append(Found(self.guard.state, float(np.abs(angles).max()), max(limits)))
            return True

        self.guard.run(over)
        return found[0]


@contextmanager
def guarded_port(*, firmware="0.2.0", thresholds=None, rewire=None, seed=3, **fields):
    spec = EmulatedSpec(firmware=firmware, seed=seed)
    electronics, workbench = build_emulated(load_unit("reference"), spec, rewire=rewire)
    link = InProcessLink(electronics)
    line = ScriptedLine(link, electronics.clock)
    usual = firmware_of(firmware).settings
    spans = CommandWindow.for_firmware(firmware, None, "right").spans_counts()
    kind = GuardedKind(spans, usual, thresholds or Thresholds())
    stops, said = [], []
    guard = PortGuard(
        line.connect, electronics.clock, kind, name="emulated", has_client=line.has_client, stopped=stops.append,
        said=said.append, **fields,
    )  # fmt: skip
    yield Guarded(line, guard, electronics, workbench, stops, said)


def stream(start, seconds, poses, period_s=0.01):
    """Yield the frames of a client that sends poses in turn, each for a second, from `start` (clock s)."""
    for step in range(round(seconds / period_s)):
        pose = poses[int(step * period_s) % len(poses)]
        yield start + step * period_s, make_positions(np.rint(np.asarray(pose) * MAX_CODE).astype(int))
