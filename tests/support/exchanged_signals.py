"""Signals between a guarded driver and its board, reconstructed from the bytes and sampled every 20 ms."""

import struct
from collections import deque

import numpy as np

from aero import protocol
from aero.driver import CURRENT_A_PER_UNIT
from aero.protocol import FRAME_SIZE, MAX_CODE, Opcode, parse_reply
from aero.safety import Thresholds

STEP_S = 0.02
TELEMETRY_S = 0.05
"""Tolerance for the age of a value, and for the delay of a command, s."""
FRESH_S = 0.1
"""Age limit of the latest positions and currents for a reaction, s."""
ANSWERED = frozenset({Opcode.GET_POS, Opcode.GET_VEL, Opcode.GET_CURR, Opcode.GET_TEMP, Opcode.SET_SPE, Opcode.SET_TOR})
"""Requests with an immediate answer; homing may take a minute."""


def events(log):
    """Yield (t, kind, values) of a log of (t, direction, bytes); a reply is matched to the oldest request that fits."""
    pending, buffer = [], bytearray()
    for t, direction, data in log:
        if direction == ">":
            if len(data) != FRAME_SIZE:
                yield t, "search", None  # zeros
            elif data[0] == Opcode.CTRL_POS:
                yield t, "command", protocol.unsigned_values(parse_reply(data)) / MAX_CODE
            elif data[0] in {Opcode.CTRL_TOR, Opcode.HOMING}:
                yield t, "torque", None
            elif data[0] in ANSWERED:
                pending.append(data[0])
                yield t, "asked", None
            continue
        buffer += data
        while buffer:
            if buffer[0] not in pending or buffer[1:2] not in (b"", b"\0"):
                del buffer[0]
                continue
            if len(buffer) < FRAME_SIZE:
                break
            opcode, _, *words = struct.unpack("<BB7H", buffer[:FRAME_SIZE])
            reply = protocol.Reply(opcode, tuple(words))
            del buffer[:FRAME_SIZE]
            del pending[: pending.index(opcode) + 1]
            yield t, "answered", None
            if opcode == Opcode.GET_POS:
                yield t, "positions", protocol.unsigned_values(reply) / MAX_CODE
            elif opcode == Opcode.GET_CURR:
                yield t, "currents", protocol.signed_values(reply) * CURRENT_A_PER_UNIT
            elif opcode == Opcode.GET_TEMP:
                yield t, "temperatures", protocol.unsigned_values(reply)


class Signals:
    """Largest value of each signal over the channels at one time."""

    def __init__(self):
        self.current = self.step = 0.0
        self.beyond = self.short = -1.0
        self._follow_s = Thresholds().follow_s + TELEMETRY_S
        self._known_from, self._read_at, self._temperatures_at = np.inf, -np.inf, 0.0
        self._silent_from = self._repeated_from = self._positions = None
        self._last, self._commands = b"", deque()

    def take(self, t, what, values):
        """Process the next event."""
        if what == "asked":
            self._silent_from = t if self._silent_from is None else self._silent_from
        elif what in {"answered", "search"}:
            self._silent_from = None
        elif what == "torque":
            self._commands.clear()
            self._known_from, self.beyond, self.short = np.inf, -1.0, -1.0
        elif what == "temperatures":
            self._temperatures_at = t
        elif what == "command":
            if not self._commands:
                self._known_from = t + self._follow_s
            near = self._commands and t - self._commands[-1][0] < 3 * STEP_S
            self.step = float(np.abs(values - self._commands[-1][1]).max()) if near else 0.0
            self._commands.append((t, values))
        elif what == "positions":
            self._positions = values
            self._compare(t, values)
        elif what == "currents" and self._positions is not None:
            self.current, self._read_at = float(np.abs(values).max()), t
            reading = self._positions.tobytes() + values.tobytes()
            if reading != self._last:
                self._repeated_from, self._last = t, reading

    def _compare(self, t, positions):
        # A command holds until the next one, so the last one before the time that counts belongs to it.
        while len(self._commands) > 1 and self._commands[1][0] < t - self._follow_s:
            self._commands.popleft()
        if t >= self._known_from:
            recent = np.array([values for _, values in self._commands])
            self.beyond = float((positions - recent.max(axis=0)).max())
            self.short = float((recent.min(axis=0) - positions).max())

    def row(self, t):
        """Return the signals at `t` (s)."""
        fresh = t - self._read_at <= FRESH_S
        return {
            "current": self.current,
            "temperatures_age": t - self._temperatures_at,
            "beyond": self.beyond,
            "short": self.short,
            "step": self.step,
            "fresh": fresh,
            "silence": 0.0 if self._silent_from is None else t - self._silent_from,
            "stale": t - self._repeated_from if fresh and self._repeated_from is not None else 0.0,
        }


def signals(log, end_s):
    """Return times (n,) up to `end_s`, s, and the signals by name, (n,) each; A, °C, s, fractions of the window."""
    times, state, rows = np.arange(0.0, end_s + STEP_S / 2, STEP_S), Signals(), []
    waiting = deque(events(log))
    for t in times.tolist():
        while waiting and waiting[0][0] <= t:
            state.take(*waiting.popleft())
        rows.append(state.row(t))
    return times, {name: np.array([row[name] for row in rows]) for name in rows[0]}


def longest_s(holds):
    """Return the longest uninterrupted duration of a condition (n,), s."""
    longest = run = 0
    for now in holds.tolist():
        run = run + 1 if now else 0
        longest = max(longest, run)
    return longest * STEP_S
