"""Faults of the board: lost or wrong memory, restarts."""

from __future__ import annotations

from collections.abc import Callable

from aero.channels import WIRE_ORDER
from firmware_emulator.firmware.board import Board
from firmware_emulator.firmware.calibrate_mid import centre
from firmware_emulator.firmware.homing import home
from firmware_emulator.hand import EmulatedHand
from firmware_emulator.kernel import Task
from hil.faults.active import Active
from hil.faults.assembly import HandAssembly
from hil.faults.fault import ALL, Fault, FaultLayer, Inject, Injection, Severity
from hil.faults.part import Part


def _event(
    act: Callable[[EmulatedHand, Injection], object], undo: Callable[[EmulatedHand, Injection], object] | None = None
) -> Inject:
    """Return what injects something that happens to the electronics."""

    def inject(assembly: HandAssembly, fault: Injection) -> Active:
        clear = None if undo is None else lambda: undo(assembly.hand, fault)
        return Active(lambda: act(assembly.hand, fault), clear)

    return inject


def _restart(hand: EmulatedHand, fault: Injection) -> None:
    hand.reset("reset")


def _power_cycle(hand: EmulatedHand, fault: Injection) -> None:
    hand.reset("power_on")


def _hang(hand: EmulatedHand, fault: Injection) -> None:
    hand.board.stop()


def _forget(hand: EmulatedHand, fault: Injection) -> None:
    board = _emulated(hand, fault)
    for key, _ in board.nvs.items():
        board.nvs.forget(key)
    hand.reset("reset")


def _trim(hand: EmulatedHand, fault: Injection) -> None:
    _trim_by(hand, fault, round(fault.severity))


def _trim_back(hand: EmulatedHand, fault: Injection) -> None:
    _trim_by(hand, fault, -round(fault.severity))


def _trim_by(hand: EmulatedHand, fault: Injection, counts: int) -> None:
    board, servo = _emulated(hand, fault), WIRE_ORDER.index(fault.where)
    board.window.extend[servo] += counts
    board.nvs.store_extend(servo, board.window.extend[servo])


def _centre(hand: EmulatedHand, fault: Injection) -> None:
    _under_lock(hand, fault, homes=False)


def _centre_and_home(hand: EmulatedHand, fault: Injection) -> None:
    _under_lock(hand, fault, homes=True)


def _under_lock(hand: EmulatedHand, fault: Injection, *, homes: bool) -> None:
    """Let the board do what another program has asked of it; its acknowledgement went there."""
    board, servo = _emulated(hand, fault), WIRE_ORDER.index(fault.where)

    def task() -> Task:
        yield from board.lock.take()
        yield from centre(board, servo)
        board.lock.give()
        if homes:
            yield from home(board)

    board.start(task())


def _emulated(hand: EmulatedHand, fault: Injection) -> Board:
    if not isinstance(hand.board, Board):
        raise ValueError(f"{fault} cannot be put into a firmware program; leave out the program or the fault")
    return hand.board


FAULTS = (
    Fault(
        "board_restart",
        FaultLayer.BOARD,
        Part.BOARD,
        "the board restarts",
        _event(_restart),
        at_s=5.0,
        alike=(Part.SUPPLY, Part.USB),
    ),
    Fault(
        "power_cycle",
        FaultLayer.BOARD,
        Part.SUPPLY,
        "power is lost and returns",
        _event(_power_cycle),
        at_s=5.0,
        alike=(Part.BOARD, Part.USB),
    ),
    Fault(
        "board_hangs",
        FaultLayer.BOARD,
        Part.BOARD,
        "the board does nothing more",
        _event(_hang, _restart),
        at_s=5.0,
        alike=(Part.USB,),
    ),
    Fault(
        "nvs_lost",
        FaultLayer.BOARD,
        Part.SETUP,
        "the board restarts without its stored zeros",
        _event(_forget),
        alike=(Part.BOARD,),
    ),
    Fault(
        "trim_left_in",
        FaultLayer.BOARD,
        Part.SETUP,
        "the open end is trimmed away",
        _event(_trim, _trim_back),
        ALL,
        Severity("counts", (40, 120, 400), -2048, 2048),
    ),
    Fault(
        "calibrated_mid",
        FaultLayer.BOARD,
        Part.SETUP,
        "CALIBRATE_MID moved a servo's zero, and the commands stay as they were",
        _event(_centre),
        ALL,
        at_s=5.0,
    ),
    Fault(
        "calibrated_mid_and_homed",
        FaultLayer.BOARD,
        Part.SETUP,
        "CALIBRATE_MID, then HOMING, which undoes it; nothing is read meanwhile",
        _event(_centre_and_home),
        ALL,
        at_s=5.0,
    ),
)
