"""The main loop: one host frame a pass, in order, and the soft limit of torque mode in between."""

from __future__ import annotations

from firmware_emulator.firmware.board import Board
from firmware_emulator.firmware.frames import words_of
from firmware_emulator.firmware.opcodes import HANDLERS
from firmware_emulator.firmware.torque_mode import enforce_soft_limit, soft_limit_is_on
from firmware_emulator.kernel import Task


def main_loop(board: Board) -> Task:
    """Run for ever; an opcode that takes long (homing) holds up everything behind it, which stays queued."""
    while True:
        if soft_limit_is_on(board) and board.kernel.now >= board.torque_mode.next_check_s:
            yield from enforce_soft_limit(board)
        frame = board.next_frame()
        if frame is not None:
            yield board.host_latency_s
            if frame[0] in board.profile.opcodes:
                yield from HANDLERS[frame[0]](board, words_of(frame))
        elif soft_limit_is_on(board):
            yield board.queued, board.torque_mode.next_check_s
        else:
            yield board.queued
