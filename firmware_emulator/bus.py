"""The half-duplex servo bus at 1 Mbit/s: bytes on a wire, with their times.

Theory of operation. A master writes bytes through a `BusPort`; they occupy the wire for 10 µs each, behind whatever
occupies it already. When the last byte of a packet has arrived, the addressed servos act, and each answer follows the
turnaround time after the end of what it answers. Answers reach the port that asked, in one piece when the last byte
of the train is there. Servos with the same ID answer at the same time: their bytes meet on the wire and are AND-ed.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol

from firmware_emulator.kernel import Kernel, on_grid
from firmware_emulator.packets import BROADCAST, Instruction, Packet, PacketParser, pack
from firmware_emulator.servo.instructions import ALWAYS_ANSWERED, EXECUTE, LONGEST_READ
from firmware_emulator.servo.servo import Servo

BYTE_S = 10e-6
"""Time of one byte: ten bits at 1 Mbit/s, s."""
SILENCE_S = 5e-3
"""Silence after which a servo's receiver forgets a packet that was begun, s (assumption)."""


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
            bus.kernel.call_at(start + count * BYTE_S, bus.execute, packet, self)
        self._last_byte = bus.busy_until = start + len(data) * BYTE_S
        return self._last_byte


class ServoBus:
    """Servos on one wire."""

    def __init__(self, kernel: Kernel, servos: Sequence[Servo], turnaround_s: float) -> None:
        self.kernel = kernel
        self.busy_until = 0.0
        self.servos = list(servos)
        self.tap: Tap | None = None
        self._turnaround_s = turnaround_s

    def connect(self, receive: Callable[[bytes], None]) -> BusPort:
        """Return a new master's port; `receive` gets the answers to what it writes."""
        return BusPort(self, receive)

    def execute(self, packet: Packet, port: BusPort) -> None:
        """Let the addressed servos act on a packet whose last byte has just arrived, and send their answers."""
        now = self.kernel.now
        if packet.code == Instruction.SYNC_READ:
            answers = self._sync_read(packet)
        elif packet.code == Instruction.SYNC_WRITE:
            self._sync_write(packet)
            return
        else:
            answers = self._single(packet)
        if answers:
            data = b"".join(answers)
            end = on_grid(now + len(answers) * self._turnaround_s + len(data) * BYTE_S)
            self.busy_until = max(self.busy_until, end)
            if self.tap is not None:
                data = self.tap.answered(data)
            self.kernel.call_at(end, port.receive, data)

    def _listening(self, wanted: int) -> list[Servo]:
        """Servos that take a packet for this ID."""
        now = self.kernel.now
        addressed = self.servos if wanted == BROADCAST else [s for s in self.servos if s.id == wanted]
        return [s for s in addressed if s.silent_until <= now]

    def _single(self, packet: Packet) -> list[bytes]:
        execute = EXECUTE.get(packet.code)
        if execute is None:
            return []
        silent = packet.servo == BROADCAST and packet.code != Instruction.PING
        answers: dict[int, bytes] = {}
        for servo in self._listening(packet.servo):
            # An answer to an ID write still carries the old ID (assumption 7 of the docs).
            answering, level = servo.id, servo.response_level
            parameters = execute(servo, packet.parameters)
            if parameters is None or silent or not (level or packet.code in ALWAYS_ANSWERED):
                continue
            answers[answering] = _meet(answers.get(answering), pack(answering, servo.status, parameters))
        return [answers[servo] for servo in sorted(answers)]

    def _sync_read(self, packet: Packet) -> list[bytes]:
        if packet.servo != BROADCAST or len(packet.parameters) < 3:
            return []
        address, count = packet.parameters[:2]
        wanted = packet.parameters[2:]
        if count > LONGEST_READ:
            return []
        answers: dict[int, bytes] = {}
        for servo in self._listening(BROADCAST):
            number = servo.id
            if number in wanted:
                answer = pack(number, servo.status, servo.read(address, count))
                answers[number] = _meet(answers[number], answer) if number in answers else answer
        return [answers[number] for number in wanted if number in answers]

    def _sync_write(self, packet: Packet) -> None:
        parameters = packet.parameters
        if packet.servo != BROADCAST or len(parameters) < 2:
            return
        address, count = parameters[:2]
        for at in range(2, len(parameters) - count, count + 1):
            for servo in self._listening(parameters[at]) if parameters[at] != BROADCAST else ():
                servo.write(address, parameters[at + 1 : at + 1 + count])


def _meet(first: bytes | None, second: bytes) -> bytes:
    """Bytes of two answers that are sent at the same time, as the wire carries them."""
    if first is None:
        return second
    longer, shorter = (first, second) if len(first) >= len(second) else (second, first)
    return bytes(a & b for a, b in zip(longer, shorter, strict=False)) + longer[len(shorter) :]
