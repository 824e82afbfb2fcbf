"""The main loop: one host frame a pass, in order, and the soft limit of torque mode in between."""

from __future__ import annotations

from firmware_emulator.firmware.board import Board
from firmware_emulator.firmware.frames import words_of
from firmware_emulator.firmware.opcodes import HANDLERS
from firmware_emulator.firmware.torque_mode import look_at_soft_limit, next_look
from firmware_emulator.kernel import BEHIND, Task


def main_loop(board: Board) -> Task:
    """Run for ever; an opcode that takes long (homing) holds up everything behind it, which stays queued."""
    yield from look_at_soft_limit(board)
    while True:
        frame = board.next_frame()
        if frame is None:
            due = next_look(board)
            yield (board.queued, due) if due is not None else board.queued
            # What arrives at this instant is there first; then the chip lets a task whose tick has come go before a
            # loop that polls.
            yield BEHIND
            yield BEHIND
            frame = board.next_frame()
        if frame is not None and frame[0] in board.profile.opcodes:
            yield from HANDLERS[frame[0]](board, words_of(frame))
        yield from look_at_soft_limit(board)
