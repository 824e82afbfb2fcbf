"""Homing: executes a `HomingPlan` on the bus with the firmware's sequence of library calls.

Each channel searches until its current reaches a threshold (contact with an end stop) or until a time-out; in both
cases the position counts as the contact. The search goal of +-50000 overflows the library's 16 bits to -+15536, so the
search runs against the direction in the table. Failures are never reported.
"""

from dataclasses import replace

from firmware_emulator.firmware.board import Board
from firmware_emulator.firmware.homing_plan import (
    Calibrate,
    Go,
    HomingPlan,
    HomingTarget,
    Limits,
    Move,
    ReadPosition,
    ShiftWindow,
    Step,
)
from firmware_emulator.firmware.servo_calls import (
    GOAL_ADDRESS,
    calibrate,
    goal,
    read_signed,
    unlock,
    write_limits,
    write_register,
)
from firmware_emulator.kernel import Task, milliseconds, ticks_later
from firmware_emulator.servo.model_file import FEEDBACK, FEEDBACK_SIZE
from firmware_emulator.servo.models import REGISTERS

BEYOND_COUNTS = 50_000
HALF_TURN = 2048
NEAR_EXTEND_COUNTS = 625
LIMIT_MARGIN_COUNTS = 113
MAX_COUNTS = 4095
CURRENT_LIMIT = 1023


def home(board: Board) -> Task:
    """Home all channels and store the extend values, holding the bus lock up to the last move."""
    plan = board.profile.homing
    yield from board.lock.take()
    board.window.reset(board.config)
    for group in plan.groups:
        yield from _Group(board, plan, group).run()
    for channel in plan.final:
        yield from _go(board, channel, board.window.extend[channel], plan.final_move)
    board.lock.give()
    if plan.repairs_current_limit:
        # Without the lock, as in the firmware: a homing requested by the host races the telemetry task here.
        for channel in range(len(plan.steps)):
            yield from _repair_current_limit(board, channel)
    for channel, extend in enumerate(board.window.extend):
        board.nvs.store_extend(channel, extend)


def assume_homed(board: Board) -> Task:
    """Set firmware and servos to their state after `home`, without a search; the present counts are trusted.

    Stored extend values are kept: they are the result of an earlier homing and later trims.
    """
    plan = board.profile.homing
    board.window.reset(board.config)
    for channel, steps in enumerate(plan.steps):
        for step in steps:
            if isinstance(step, ShiftWindow):
                board.window.shift(channel, step.counts * board.config.direction[channel])
        board.window.extend[channel] = board.nvs.extend(channel, board.window.extend[channel])
        yield from _open_limits(board, channel)
        yield from unlock(board.uart, channel)
        yield from _close_limits(board, channel)
        yield from _go(board, channel, board.window.extend[channel], plan.final_move)
        board.nvs.store_extend(channel, board.window.extend[channel])


class _Group:
    """Channels that search simultaneously, followed by each channel's steps."""

    def __init__(self, board: Board, plan: HomingPlan, channels: tuple[int, ...]) -> None:
        self.board = board
        self._plan = plan
        self._channels = channels
        self._position = dict.fromkeys(channels, 0)

    def run(self) -> Task:
        for channel in self._channels:
            yield from self._prepare(channel)
        yield from self._search()
        for channel in self._channels:
            for step in self._plan.steps[channel]:
                yield from self._take(channel, step)
            yield from _close_limits(self.board, channel)

    def _prepare(self, channel: int) -> Task:
        uart = self.board.uart
        yield from _open_limits(self.board, channel)
        yield from write_register(uart, channel, "mode", 0)
        yield from uart.read(channel, FEEDBACK, FEEDBACK_SIZE)

    def _search(self) -> Task:
        kernel, plan = self.board.kernel, self._plan
        alone = len(self._channels) == 1
        started = milliseconds(kernel.now)
        searching = list(self._channels)
        while searching:
            for channel in searching:
                yield from self._push(channel)
            for channel in tuple(searching):
                if (yield from self._meets(channel)):
                    searching.remove(channel)
            # A single channel times out before the tick's wait; a group times out after the wait.
            if alone and milliseconds(kernel.now) - started > plan.timeout_ms:
                return
            yield ticks_later(kernel.now, 1)
            if not alone and milliseconds(kernel.now) - started > plan.timeout_ms:
                return

    def _push(self, channel: int) -> Task:
        beyond = BEYOND_COUNTS * self.board.config.direction[channel]
        yield from _go(self.board, channel, beyond, replace(self._plan.search, torque=self._plan.thresholds[channel]))

    def _meets(self, channel: int) -> Task:
        """Read current and position of a channel; return whether the current indicates contact."""
        board, plan = self.board, self._plan
        current = yield from read_signed(board.uart, channel, "present_current")
        self._position[channel] = yield from read_signed(board.uart, channel, "present_position")
        if abs(current) < plan.thresholds[channel]:
            return False
        if plan.release is not None and len(self._channels) > 1:
            yield from _go(board, channel, self._position[channel], plan.release)
        return True

    def _take(self, channel: int, step: Step) -> Task:
        board = self.board
        match step:
            case Go(to, move, wait_ms):
                yield from _go(board, channel, self._target(channel, to), move)
                if wait_ms:
                    yield ticks_later(board.kernel.now, wait_ms)
            case Calibrate(wait_ms):
                yield from calibrate(board.uart, channel)
                yield ticks_later(board.kernel.now, wait_ms)
            case ReadPosition():
                self._position[channel] = yield from read_signed(board.uart, channel, "present_position")
            case ShiftWindow(counts):
                board.window.shift(channel, counts * board.config.direction[channel])

    def _target(self, channel: int, to: HomingTarget) -> int:
        window, direction = self.board.window, self.board.config.direction[channel]
        return {
            HomingTarget.CONTACT: self._position[channel],
            HomingTarget.GRASP: window.grasp[channel],
            HomingTarget.EXTEND: window.extend[channel],
            HomingTarget.BACK_OFF: self._position[channel] + HALF_TURN * direction,
            HomingTarget.SHORT_OF_EXTEND: window.extend[channel] - NEAR_EXTEND_COUNTS * direction,
        }[to]


def _go(board: Board, channel: int, position: int, move: Move) -> Task:
    data = goal(position, speed=move.speed, acceleration=move.acceleration, torque=move.torque)
    return board.uart.write(channel, GOAL_ADDRESS, data)


def _open_limits(board: Board, channel: int) -> Task:
    if board.profile.homing.limits is not Limits.UNTOUCHED:
        yield from write_limits(board.uart, channel, 0, 0)


def _close_limits(board: Board, channel: int) -> Task:
    if board.profile.homing.limits is Limits.WINDOW:
        ends = board.window.extend[channel], board.window.grasp[channel]
        low, high = max(min(ends) - LIMIT_MARGIN_COUNTS, 0), min(max(ends) + LIMIT_MARGIN_COUNTS, MAX_COUNTS)
        yield from write_limits(board.uart, channel, low, high)


def _repair_current_limit(board: Board, channel: int) -> Task:
    uart = board.uart
    if not (yield from uart.ping(channel)):
        return
    limit = yield from uart.read(channel, REGISTERS["protection_current"].address, 2)
    if limit is None or int.from_bytes(limit, "little") == CURRENT_LIMIT:
        return
    yield from unlock(uart, channel)
    yield from write_register(uart, channel, "protection_current", CURRENT_LIMIT)
    yield from write_register(uart, channel, "lock", 1)
