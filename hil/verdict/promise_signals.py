"""From the bytes between a guarded driver and its hand to the signals that the guard's promises speak of."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from aero import protocol
from aero.driver import CURRENT_A_PER_UNIT
from aero.protocol import FILLER, FRAME_SIZE, MAX_CODE, Opcode, parse_reply
from hil.targets.wire_log import WireRecord
from hil.verdict.promises import STEP_S, YES

Floats = NDArray[np.float64]
FOLLOW_S = 2.0
"""Commands no older than this say where an encoder may be, s."""
TELEMETRY_S = 0.05
"""What the guard allows for the age of a value, and a command for its way, s."""
FRESH_S = 0.1
"""Age of the last positions and currents up to which what they say can be acted on, s."""
ANSWERED = frozenset({Opcode.GET_POS, Opcode.GET_VEL, Opcode.GET_CURR, Opcode.GET_TEMP, Opcode.SET_SPE, Opcode.SET_TOR})
"""Requests that a board answers at once; homing may take a minute."""
SignalEvent = tuple[
    float,
    Literal["command", "torque", "positions", "currents", "temperatures", "asked", "answered", "search"],
    Floats | None,
]
"""Time, s, what happened, and its values, (7,) in command order: shares of the window, A or °C."""


def events(wire: Iterable[WireRecord]) -> list[SignalEvent]:
    """Return what crossed the link, in order; a reply is taken for that of the oldest request that it can answer."""
    found: list[SignalEvent] = []
    pending: list[int] = []
    buffer = bytearray()
    for t, direction, data in wire:
        if direction == "to_hand":
            if len(data) != FRAME_SIZE:
                found.append((t, "search", None))  # zeros
                continue
            if data[0] == Opcode.CTRL_POS:
                found.append((t, "command", protocol.unsigned_values(parse_reply(data)) / MAX_CODE))
            elif data[0] in {Opcode.CTRL_TOR, Opcode.HOMING}:
                found.append((t, "torque", None))
            elif data[0] in ANSWERED:
                pending.append(data[0])
                found.append((t, "asked", None))
            continue
        buffer += data
        while buffer:
            if buffer[0] not in pending or buffer[1:2] not in (b"", bytes((FILLER,))):
                del buffer[0]
                continue
            if len(buffer) < FRAME_SIZE:
                break
            reply = parse_reply(bytes(buffer[:FRAME_SIZE]))
            del buffer[:FRAME_SIZE]
            del pending[: pending.index(reply.opcode) + 1]
            found.append((t, "answered", None))
            if reply.opcode == Opcode.GET_POS:
                found.append((t, "positions", protocol.unsigned_values(reply) / MAX_CODE))
            elif reply.opcode == Opcode.GET_CURR:
                found.append((t, "currents", protocol.signed_values(reply).astype(np.float64) * CURRENT_A_PER_UNIT))
            elif reply.opcode == Opcode.GET_TEMP:
                found.append((t, "temperatures", protocol.unsigned_values(reply).astype(np.float64)))
    return found


@dataclass
class _State:
    """What is known at a moment."""

    current: float = 0.0
    temperature: float = 0.0
    beyond: float = -1.0
    short: float = -1.0
    step: float = 0.0
    known_from: float = np.inf
    """When encoders have had the time to follow the first command, s."""
    read_at: float = -YES
    """When positions and currents were last read, s."""
    silent_from: float | None = None
    repeated_from: float | None = None
    positions: Floats | None = None
    last: bytes = b""
    commands: deque[tuple[float, Floats]] = field(default_factory=deque)

    def take(self, event: SignalEvent) -> None:
        """Take what happened next."""
        t, what, values = event
        if what == "asked":
            self.silent_from = t if self.silent_from is None else self.silent_from
        elif what in {"answered", "search"}:
            self.silent_from = None
        elif what == "torque":
            self.commands.clear()
            self.known_from = np.inf
            self.beyond = self.short = -1.0
        elif what == "temperatures" and values is not None:
            self.temperature = float(values.max())
        elif what == "command" and values is not None:
            self._command(t, values)
        elif what == "positions" and values is not None:
            self.positions = values
            self._stray(t, values)
        elif what == "currents" and values is not None and self.positions is not None:
            self.current = float(np.abs(values).max())
            self.read_at = t
            reading = self.positions.tobytes() + values.tobytes()
            if reading != self.last:
                self.repeated_from, self.last = t, reading

    def _command(self, t: float, shares: Floats) -> None:
        if not self.commands:
            self.known_from = t + FOLLOW_S + TELEMETRY_S
        if self.commands and t - self.commands[-1][0] < 3 * STEP_S:
            self.step = float(np.abs(shares - self.commands[-1][1]).max())
        else:
            self.step = 0.0
        self.commands.append((t, shares))

    def _stray(self, t: float, shares: Floats) -> None:
        # A command holds until the next one, so the last one before the time that counts belongs to it.
        while len(self.commands) > 1 and self.commands[1][0] < t - FOLLOW_S - TELEMETRY_S:
            self.commands.popleft()
        if t < self.known_from:
            return
        recent = np.array([command for _, command in self.commands])
        self.beyond = float((shares - recent.max(axis=0)).max())
        self.short = float((recent.min(axis=0) - shares).max())

    def row(self, t: float) -> dict[str, float]:
        """Return the signals at `t` (s)."""
        return {
            "current": self.current,
            "temperature": self.temperature,
            "beyond": self.beyond,
            "short": self.short,
            "step": self.step,
            "fresh": YES if t - self.read_at <= FRESH_S else -YES,
            "silence": 0.0 if self.silent_from is None else t - self.silent_from,
            "stale": 0.0 if self.repeated_from is None or t - self.read_at > FRESH_S else t - self.repeated_from,
        }


def signals(wire: Iterable[WireRecord], end_s: float) -> tuple[Floats, Mapping[str, Floats]]:
    """Return the times, (n,) s, every `STEP_S` up to `end_s`, and the signals at them by name, (n,) each.

    `current` A, `temperature` °C, `beyond`, `short` and `step` shares of the window, of the channel where each is
    largest; `silence` and `stale` s; `fresh` whether positions and currents were read in the last 0.1 s.
    """
    times = np.arange(0.0, end_s + STEP_S / 2, STEP_S)
    state, rows = _State(), []
    waiting = deque(events(wire))
    for t in times.tolist():
        while waiting and waiting[0][0] <= t:
            state.take(waiting.popleft())
        rows.append(state.row(t))
    return times, {name: np.array([row[name] for row in rows]) for name in _State().row(0.0)}
