"""Session runner: records all output of a board with its time, and compares two boards."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass, field
from itertools import zip_longest
from pathlib import Path
from typing import Any

from firmware_emulator.bench import Bench, BenchShaft
from firmware_emulator.compare.sessions import Await, Damage, Heat, Reset, Send, Servos, Session, Step, Wait
from firmware_emulator.firmware.hands import EXTEND_ANGLE_DEG, HANDS, SERVOS, SHAFT_OF_SERVO, Side
from firmware_emulator.firmware.nvs import Nvs
from firmware_emulator.firmware.profiles import DEFAULT_VERSION, PROFILES
from firmware_emulator.hand import EmulatedHand
from firmware_emulator.kernel import Task
from firmware_emulator.servo.parameters import HLS3606M, ServoParameters

SAMPLE_S = 0.05
"""Sampling period of the shaft angles, s."""
ABDUCTION = 0
HOST, BUS, STORE = "host", "servo bus", "storage"


@dataclass(frozen=True)
class Contender:
    """Firmware to compare: an emulated version, or a program."""

    side: Side
    version: str = DEFAULT_VERSION
    program: Path | None = None
    servos: ServoParameters = HLS3606M
    """Parameters of the emulated servos that the firmware drives."""


def contender(name: str, side: Side) -> Contender:
    """Return the firmware named by a version or by the path of a program.

    Raises:
        ValueError: the name is neither a version nor an executable file.
    """
    if name in PROFILES:
        return Contender(side, version=name)
    if not (Path(name).is_file() and os.access(name, os.X_OK)):
        raise ValueError(f"{name!r} is neither a version ({', '.join(PROFILES)}) nor a program of `firmware build`")
    return Contender(side, program=Path(name))


@dataclass
class BoardTrace:
    """Recorded output of a board in a session."""

    events: dict[str, list[tuple[int, bytes]]] = field(default_factory=lambda: {HOST: [], BUS: [], STORE: []})
    """Time (ns) and bytes of each event, by destination; simultaneous bytes to the host are one event."""
    angles: list[tuple[float, ...]] = field(default_factory=list)
    """Shaft angles every `SAMPLE_S`, degrees, command order."""
    registers: list[dict[str, int]] = field(default_factory=list)
    """Registers of every servo at the end of the session."""

    def add(self, where: str, t: float, data: bytes) -> None:
        """Record an event."""
        ns = round(t * 1e9)
        events = self.events[where]
        if where == HOST and events and events[-1][0] == ns:
            events[-1] = (ns, events[-1][1] + data)
        else:
            events.append((ns, data))


class _NotedNvs(Nvs):
    """Storage that records its writes, including those that change nothing."""

    def __init__(self, stage: Stage, stored: tuple[tuple[str, int], ...]) -> None:
        super().__init__()
        for key, value in stored:
            super().store(key, value)
        self._stage = stage

    def store(self, key: str, value: int) -> None:
        super().store(key, value)
        self._stage.trace.add(STORE, self._stage.electronics.kernel.now, f"{key}={value}".encode())


class Stage:
    """Board in a session, on seven bare shafts with end stops for homing."""

    def __init__(self, firmware: Contender, session: Session) -> None:
        """Prepare a session for `run`."""
        self.trace = BoardTrace()
        self._damages: list[Damage] = []
        self._plant = stopped_shafts(firmware.side) if session.stops else Bench()
        self.electronics = EmulatedHand(
            self._plant,
            firmware=firmware.version,
            side=firmware.side,
            start="bare",
            program=firmware.program,
            servos=firmware.servos,
            nvs=_NotedNvs(self, session.stored),
        )
        self._all = list(self.electronics.bus.servos)
        self.electronics.bus.tap = self
        self.electronics.on_transmit = self._heard
        self._heard_bytes = 0
        self._now_us = 0
        self._session = session

    def run(self) -> BoardTrace:
        """Run the session to its end and return the recorded output."""
        try:
            self.electronics.kernel.spawn(self._watch_shafts())
            self._do(Reset(self._session.start))
            for step in self._session.steps:
                self._do(step)
        finally:
            self.electronics.close()
        self.trace.registers = [_registers(servo) for servo in self._all]
        return self.trace

    def asked(self, data: bytes) -> None:
        """Record a packet from the board to the servos."""
        self.trace.add(BUS, self.electronics.kernel.now, data)

    def answered(self, data: bytes) -> bytes:
        """Return an answer with the next scheduled damage applied."""
        if not self._damages:
            return data
        present = self._damages[0]
        if present.after > 0:
            self._damages[0] = Damage(present.after - 1, present.keep, present.flip, present.before, present.replace)
            return data
        return self._damages.pop(0).applied(data)

    def _do(self, step: Step) -> None:
        match step:
            case Send(data):
                self.electronics.receive(data)
            case Wait(microseconds):
                self._advance(microseconds)
            case Await(count, longest_s):
                wanted, limit = self._heard_bytes + count, self._now_us + round(longest_s * 1e6)
                while self._heard_bytes < wanted and self._now_us < limit:
                    self._advance(10_000)
            case Reset(cause):
                self.electronics.reset(cause)
            case Damage():
                self._damages.append(step)
            case Servos(present):
                self.electronics.bus.servos[:] = [self._all[servo] for servo in present]
            case Heat(servo, celsius):
                self._all[servo].heat_to(celsius)

    def _advance(self, microseconds: int) -> None:
        self._now_us += microseconds
        self.electronics.kernel.run_until(self._now_us / 1e6)

    def _heard(self, data: bytes) -> None:
        self._heard_bytes += len(data)
        self.trace.add(HOST, self.electronics.kernel.now, data)

    def _watch_shafts(self) -> Task:
        while True:
            self.electronics.advance_plant()
            self.trace.angles.append(tuple(math.degrees(angle) for angle in self._plant.angles()))
            yield self.electronics.kernel.now + SAMPLE_S


def stopped_shafts(side: Side) -> Bench:
    """Return seven bare shafts with the end stops of the hand's channels."""
    config = HANDS[side]
    shafts = [BenchShaft()] * len(SERVOS)
    for servo, shaft in enumerate(SHAFT_OF_SERVO):
        span = abs(config.grasp[servo] - config.extend[servo]) * 360.0 / 4096
        end = math.radians(EXTEND_ANGLE_DEG[servo] + span)
        stop: dict[str, Any] = {"stop_low": 0.0} if servo == ABDUCTION else {"stop_high": end}
        shafts[shaft] = BenchShaft(stop_stiffness=2000.0, friction=0.004, **stop)
    return Bench(tuple(shafts))


def _registers(servo: Any) -> dict[str, int]:
    names = ("id", "mode", "torque_enable", "goal_position", "goal_torque", "goal_speed", "acceleration", "lock")
    return {name: servo.memory.get(name) for name in (*names, "min_angle", "max_angle", "protection_current", "offset")}


SHAFTS = ("index", "middle", "ring", "pinky", "thumb abduction", "thumb CMC", "thumb flexor")
SHOWN_BEFORE = 3
LONGEST_BYTES = 40

Event = tuple[int, bytes] | None


@dataclass(frozen=True)
class Difference:
    """First difference between two boards."""

    where: str
    """Location of the difference: `host`, `servo bus`, `storage` or `hand`."""
    at_ns: int
    before: tuple[tuple[int, bytes], ...]
    """Last common events."""
    first: Event
    second: Event
    effects: tuple[str, ...]
    """Differences in the hand's motion and final registers, for messages."""

    def lines(self, names: tuple[str, str]) -> list[str]:
        """Return the difference as lines of text, with the names of both firmwares."""
        width = max(map(len, names))
        shown = [f"  both{'':{width - 4}} {_said(event)}" for event in self.before]
        shown += [
            f"  {name:{width}} {_said(event)}" for name, event in zip(names, (self.first, self.second), strict=True)
        ]
        effects = [f"  {effect}" for effect in self.effects] or ["  the hand ended alike"]
        return [f"first difference on the {self.where} at {self.at_ns / 1e6:.4f} ms:", *shown, *effects]


@dataclass(frozen=True)
class Comparison:
    """Result of a session on two boards."""

    difference: Difference | None
    second: BoardTrace
    packets: int
    """Number of packets of the first board on its servo bus."""
    hand_seconds: float


def compare(session: Session, first: Contender, second: Contender | BoardTrace) -> Comparison:
    """Run a session on both boards, or compare the first with a recorded trace; return the first difference."""
    a = Stage(first, session).run()
    b = second if isinstance(second, BoardTrace) else Stage(second, session).run()
    return Comparison(_difference(a, b), b, len(a.events[BUS]), len(a.angles) * SAMPLE_S)


def _difference(a: BoardTrace, b: BoardTrace) -> Difference | None:
    found = [part for where in a.events if (part := _part(where, a, b)) is not None]
    if found:
        return min(found, key=lambda difference: difference.at_ns)
    effects = _effects(a, b)
    return Difference("hand", 0, (), None, None, effects) if effects else None


def _part(where: str, a: BoardTrace, b: BoardTrace) -> Difference | None:
    first, second = a.events[where], b.events[where]
    if first == second:
        return None
    for at, (x, y) in enumerate(zip_longest(first, second)):
        if x != y:
            when = min(event[0] for event in (x, y) if event is not None)
            return Difference(where, when, tuple(first[max(at - SHOWN_BEFORE, 0) : at]), x, y, _effects(a, b))
    raise AssertionError("unequal lists without an unequal element")


def _effects(a: BoardTrace, b: BoardTrace) -> tuple[str, ...]:
    lines = []
    for shaft, name in enumerate(SHAFTS):
        apart = [abs(x[shaft] - y[shaft]) for x, y in zip(a.angles, b.angles, strict=False)]
        widest = max(apart, default=0.0)
        if widest > 0.0:
            lines.append(f"{name}: up to {widest:.3g} degrees apart, at {apart.index(widest) * SAMPLE_S:.2f} s")
    for servo, (x, y) in enumerate(zip(a.registers, b.registers, strict=True)):
        lines += [f"servo {servo}: {name} {x[name]} against {y[name]} at the end" for name in x if x[name] != y[name]]
    return tuple(lines)


def _said(event: Event) -> str:
    if event is None:
        return "nothing more"
    ns, data = event
    text = data[:LONGEST_BYTES].hex(" ") + (" ..." if len(data) > LONGEST_BYTES else "")
    return f"{ns / 1e6:12.4f} ms  {text}"
