"""The half-duplex servo bus: bytes on a wire, with their times.

Theory of operation. A master writes bytes through a `BusPort`; each occupies the wire for ten bits at the port's baud
rate, behind whatever occupies it already. When the last byte of a packet has arrived, the addressed servos act that
listen at this baud rate, and each answer follows the turnaround time after the end of what it answers. Answers reach
the port that asked, in one piece when the last byte of the train is there. Servos with the same ID answer at the same
time: their bytes meet on the wire and are AND-ed. A sync read that nothing can disturb, which is the telemetry of a
board nearly always, is one step, without packets and events (`BusPort.sync_read`).

Two masters take turns, which is convenient and not what a wire does.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol

from firmware_emulator.kernel import Kernel, on_grid
from firmware_emulator.packets import BROADCAST, Instruction, Packet, PacketParser, pack
from firmware_emulator.servo.instructions import ALWAYS_ANSWERED, EXECUTE, LONGEST_READ
from firmware_emulator.servo.servo import Servo

BITS = 10
"""Of one byte on the wire: start, eight, stop."""
BAUD = 1_000_000
"""Baud rate of a master unless it says otherwise, bit/s."""
WRITES = frozenset({Instruction.WRITE, Instruction.REG_WRITE, Instruction.ACTION})
"""What a servo takes under its secondary ID; transcribed HLS table: "write commands only"."""
OVERHEAD = 6
"""Bytes of a packet beside its parameters."""
SILENCE_S = 5e-3
"""Silence after which a servo's receiver forgets a packet that was begun, s (assumption)."""


Answer = tuple[int, int, bytes]
"""ID of a servo, its error byte and the registers that it was asked for: what `pack` makes a packet of."""


class Tap(Protocol):
    """Something on the wire that listens and may damage answers."""

    def asked(self, data: bytes) -> None:
        """Hear what a master sends at the present instant."""

    def answered(self, data: bytes) -> bytes:
        """Hear a train of answers; return what of it arrives."""
        ...


class BusPort:
    """A master's end of the bus."""

    def __init__(self, bus: ServoBus, receive: Callable[[bytes], None]) -> None:
        """Connect a master; `receive` gets what servos answer to it."""
        self.receive = receive
        self.baud = BAUD
        """bit/s; servos that listen at another one hear nothing."""
        self._bus = bus
        self._parser = PacketParser()
        self._last_byte = 0.0

    def write(self, data: bytes) -> float:
        """Put bytes on the wire; return the time (s) at which the last of them is over."""
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
        """Ask servos for registers, and let the time of the exchange pass when nothing else happens meanwhile.

        Args:
            request: the packet.
            address: first register, as in the packet.
            count: registers, as in the packet.
            wanted: IDs, as in the packet.
            deadline: when the master gives up, s.

        Returns:
            What the servos answered, when the last byte is there; None when it comes through `receive`, later.
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
        # To read them made something happen, as of a supply that breaks down.
        kernel.call_at(over, self.receive, b"".join(pack(*answer) for answer in answers))
        return None

    @property
    def byte_s(self) -> float:
        """Time of one byte, s."""
        return BITS / self.baud


class ServoBus:
    """Servos on one wire."""

    def __init__(self, kernel: Kernel, servos: Sequence[Servo], turnaround_s: float) -> None:
        self.kernel = kernel
        self.busy_until = 0.0
        self.servos = list(servos)
        self.tap: Tap | None = None
        self.turnaround_s = turnaround_s
        """Time from the end of what is answered to the answer, s."""
        self.late_s = 0.0
        """How much later than it should the next train of answers arrives, as through a slow adapter, s."""

    def connect(self, receive: Callable[[bytes], None]) -> BusPort:
        """Return a new master's port; `receive` gets the answers to what it writes."""
        return BusPort(self, receive)

    def is_regular(self, wanted: Sequence[int], baud: int, heard: float) -> bool:
        """Return whether all servos answer a sync read heard at a time (s), each once and in order, unspoiled."""
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
        """Let the addressed servos act on a packet whose last byte has just arrived, and send their answers."""
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
        """Servos that take a packet for this ID at this baud rate."""
        now, everyone = self.kernel.now, wanted == BROADCAST
        return [s for s in self.servos if (everyone or s.id == wanted) and s.silent_until <= now and s.baud == baud]

    def _also_written(self, wanted: int, baud: int) -> list[Servo]:
        """Servos whose secondary ID this is; they take writes and answer nothing."""
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
    """Bytes of two answers that are sent at the same time, as the wire carries them."""
    if first is None:
        return second
    longer, shorter = (first, second) if len(first) >= len(second) else (second, first)
    return bytes(a & b for a, b in zip(longer, shorter, strict=False)) + longer[len(shorter) :]
