"""Half-duplex servo bus: timed bytes on a wire.

Theory of operation. A master writes bytes through a `BusPort`; each occupies the wire for ten bits at the port's baud
rate, queued behind earlier traffic. After the last byte of a packet, every addressed servo at this baud rate executes
it. Each answer starts one turnaround time after the end of the request or of the previous answer. The requesting port
receives the whole train of answers at the time of its last byte. Servos with equal IDs answer simultaneously and their
bytes are AND-ed on the wire. An undisturbed sync read (nearly all telemetry) is one step without packets and events
(`BusPort.sync_read`).

Simplification: the bytes of two masters never collide; their writes are queued.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol

from firmware_emulator.kernel import Kernel, on_grid
from firmware_emulator.packets import BROADCAST, Instruction, Packet, PacketParser, pack
from firmware_emulator.servo.instructions import ALWAYS_ANSWERED, EXECUTE, LONGEST_READ
from firmware_emulator.servo.servo import Servo

BITS = 10
"""Bits on the wire per byte: one start, eight data, one stop."""
BAUD = 1_000_000
"""Default baud rate of a master, bit/s."""
WRITES = frozenset({Instruction.WRITE, Instruction.REG_WRITE, Instruction.ACTION})
"""Instructions accepted under the secondary ID. Source: transcribed HLS table, "write commands only"."""
OVERHEAD = 6
"""Length of a packet without parameters, bytes."""
SILENCE_S = 5e-3
"""Silence after which a servo's receiver drops a partial packet, s (assumption)."""


Answer = tuple[int, int, bytes]
"""Servo ID, error byte and requested register bytes: the arguments of `pack`."""


class Tap(Protocol):
    """Observer of the wire that may corrupt answers."""

    def asked(self, data: bytes) -> None:
        """Observe bytes that a master starts to send now."""

    def answered(self, data: bytes) -> bytes:
        """Observe a train of answers; return the bytes to deliver, possibly corrupted."""
        ...


class BusPort:
    """Bus port of one master."""

    def __init__(self, bus: ServoBus, receive: Callable[[bytes], None]) -> None:
        """Connect a master; `receive` is called with the servos' answers."""
        self.receive = receive
        self.baud = BAUD
        """Baud rate, bit/s; servos set to another rate receive nothing."""
        self._bus = bus
        self._parser = PacketParser()
        self._last_byte = 0.0

    def write(self, data: bytes) -> float:
        """Put bytes on the wire; return the end time of the last byte, s."""
        bus = self._bus
        if bus.tap is not None:
            bus.tap.asked(data)
        start = max(bus.kernel.now, bus.busy_until)
        if start - self._last_byte > SILENCE_S:
            self._parser.clear()
        for count, packet in self._parser.feed(data):
            bus.kernel.call_at(start + count * self.byte_s, bus.execute, packet, self)
        self._last_byte = bus.busy_until = start + len(data) * self.byte_s
        return self._last_byte

    def sync_read(
        self, request: bytes, address: int, count: int, wanted: Sequence[int], deadline: float
    ) -> list[Answer] | None:
        """Send a sync read; if no other event is due during the exchange, complete it in one step.

        Args:
            request: the packet.
            address: first register, as in the packet.
            count: registers, as in the packet.
            wanted: servo IDs, as in the packet.
            deadline: time-out of the master, absolute, s.

        Returns:
            Answers of all servos, with time advanced to the last byte; None if they will be delivered to `receive`.
        """
        bus, kernel, byte_s = self._bus, self._bus.kernel, self.byte_s
        start = max(kernel.now, bus.busy_until)
        heard = start + len(request) * byte_s
        over = on_grid(heard + len(wanted) * bus.turnaround_s + len(wanted) * (count + OVERHEAD) * byte_s)
        alone = over < deadline and kernel.is_free_until(over) and not self._parser.has_begun
        if not alone or not bus.is_regular(wanted, self.baud, heard):
            self.write(request)
            return None
        kernel.pass_until(heard)
        self._last_byte = heard
        bus.busy_until = over
        answers = [(servo.id, servo.status, servo.read(address, count)) for servo in bus.servos]
        if kernel.pass_until(over):
            return answers
        # Reading the registers scheduled an event before the end, such as a brown-out of the supply.
        kernel.call_at(over, self.receive, b"".join(pack(*answer) for answer in answers))
        return None

    @property
    def byte_s(self) -> float:
        """Duration of one byte, s."""
        return BITS / self.baud


class ServoBus:
    """Servos on one wire."""

    def __init__(self, kernel: Kernel, servos: Sequence[Servo], turnaround_s: float) -> None:
        self.kernel = kernel
        self.busy_until = 0.0
        self.servos = list(servos)
        self.tap: Tap | None = None
        self.turnaround_s = turnaround_s
        """Time from the end of a request to the start of its answer, s."""
        self.late_s = 0.0
        """Additional delay of the next train of answers, s; models a slow adapter."""

    def connect(self, receive: Callable[[bytes], None]) -> BusPort:
        """Return the port of a new master; `receive` is called with the answers."""
        return BusPort(self, receive)

    def is_regular(self, wanted: Sequence[int], baud: int, heard: float) -> bool:
        """Return whether every servo answers a sync read received at `heard` (s) once, in order and intact."""
        if self.tap is not None or self.late_s:
            return False
        if not wanted or len(wanted) != len(self.servos):
            return False
        for number, servo in zip(wanted, self.servos, strict=True):
            if servo.id != number or servo.baud != baud or servo.silent_until > heard:
                return False
            if not servo.model.knows_sync_read:
                return False
        return True

    def execute(self, packet: Packet, port: BusPort) -> None:
        """Execute a packet on the addressed servos at the time of its last byte, and send their answers."""
        now, baud = self.kernel.now, port.baud
        if packet.code == Instruction.SYNC_READ:
            answers = self._sync_read(packet, baud)
        elif packet.code == Instruction.SYNC_WRITE:
            self._sync_write(packet, baud)
            return
        else:
            answers = self._single(packet, baud)
        if answers:
            data = b"".join(answers)
            end = on_grid(now + len(answers) * self.turnaround_s + len(data) * port.byte_s)
            self.busy_until = max(self.busy_until, end)
            if self.tap is not None:
                data = self.tap.answered(data)
            self.kernel.call_at(end + self.late_s, _receive, data, port)
            self.late_s = 0.0

    def _listening(self, wanted: int, baud: int) -> list[Servo]:
        """Return the servos that receive a packet for this ID at this baud rate."""
        now, everyone = self.kernel.now, wanted == BROADCAST
        return [s for s in self.servos if (everyone or s.id == wanted) and s.silent_until <= now and s.baud == baud]

    def _also_written(self, wanted: int, baud: int) -> list[Servo]:
        """Return the servos with this secondary ID; they execute writes without answering."""
        own = [s for s in self.servos if s.secondary_id == wanted != s.id]
        return [s for s in own if s.silent_until <= self.kernel.now and s.baud == baud]

    def _single(self, packet: Packet, baud: int) -> list[bytes]:
        execute = EXECUTE.get(packet.code)
        if execute is None:
            return []
        silent = packet.servo == BROADCAST and packet.code != Instruction.PING
        answers: dict[int, bytes] = {}
        if packet.code in WRITES:
            for servo in self._also_written(packet.servo, baud):
                execute(servo, packet.parameters)
        for servo in self._listening(packet.servo, baud):
            if packet.code not in servo.model.instructions:
                continue
            # An answer to an ID write still carries the old ID (assumption 7 of the docs).
            answering, level = servo.id, servo.response_level
            parameters = execute(servo, packet.parameters)
            if parameters is None or silent or not (level or packet.code in ALWAYS_ANSWERED):
                continue
            answers[answering] = _meet(answers.get(answering), pack(answering, servo.status, parameters))
        return [answers[servo] for servo in sorted(answers)]

    def _sync_read(self, packet: Packet, baud: int) -> list[bytes]:
        if packet.servo != BROADCAST or len(packet.parameters) < 3:
            return []
        address, count = packet.parameters[:2]
        wanted = packet.parameters[2:]
        if count > LONGEST_READ:
            return []
        answers: dict[int, bytes] = {}
        for servo in self._listening(BROADCAST, baud):
            number = servo.id
            if number in wanted and servo.model.knows_sync_read:
                answer = pack(number, servo.status, servo.read(address, count))
                answers[number] = _meet(answers[number], answer) if number in answers else answer
        return [answers[number] for number in wanted if number in answers]

    def _sync_write(self, packet: Packet, baud: int) -> None:
        parameters, now = packet.parameters, self.kernel.now
        if packet.servo != BROADCAST or len(parameters) < 2:
            return
        address, count = parameters[:2]
        for at in range(2, len(parameters) - count, count + 1):
            wanted = parameters[at]
            if wanted == BROADCAST:
                continue
            taking = [s for s in self.servos if wanted in (s.id, s.secondary_id)]
            if len(taking) > 1:
                taking.sort(key=lambda s: s.id != wanted)
            for servo in taking:
                if servo.silent_until <= now and servo.baud == baud:
                    servo.write(address, parameters[at + 1 : at + 1 + count])


def _receive(data: bytes, port: BusPort) -> None:
    port.receive(data)


def _meet(first: bytes | None, second: bytes) -> bytes:
    """Return two simultaneous answers as superposed on the wire (bitwise AND)."""
    if first is None:
        return second
    longer, shorter = (first, second) if len(first) >= len(second) else (second, first)
    return bytes(a & b for a, b in zip(longer, shorter, strict=False)) + longer[len(shorter) :]
