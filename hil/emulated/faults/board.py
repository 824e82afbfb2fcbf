"""Board faults: lost or wrong memory, restarts, and a firmware other than declared (built in)."""

from collections.abc import Callable
from functools import partial

from aero.channels import WIRE_ORDER
from aero.firmware import FIRMWARE
from firmware_emulator.firmware.board import Board
from firmware_emulator.firmware.hands import Side
from firmware_emulator.firmware.homing import home
from firmware_emulator.firmware.opcodes import centre
from firmware_emulator.hand import EmulatedHand
from firmware_emulator.kernel import Task
from hil.emulated.faults.assembly import Active, HandAssembly
from hil.emulated.faults.fault import ALL, Fault, FaultLayer, Inject, Injection, Severity
from hil.verdict.part import Part

BOARD = FaultLayer.BOARD
RUNS = "board_runs_"
"""Name prefix of the faults of a version other than declared."""
OTHER_SIDE: dict[Side, Side] = {"right": "left", "left": "right"}


def _event(
    act: Callable[[EmulatedHand, Injection], object], undo: Callable[[EmulatedHand, Injection], object] | None = None
) -> Inject:

    def inject(assembly: HandAssembly, fault: Injection) -> Active:
        clear = None if undo is None else lambda: undo(assembly.electronics, fault)
        return Active(lambda: act(assembly.electronics, fault), clear)

    return inject


def _restart(electronics: EmulatedHand, fault: Injection) -> None:
    electronics.reset("reset")


def _forget(electronics: EmulatedHand, fault: Injection) -> None:
    board = _emulated(electronics, fault)
    for key, _ in board.nvs.items():
        board.nvs.forget(key)
    _restart(electronics, fault)


def _trim(electronics: EmulatedHand, fault: Injection, *, way: int) -> None:
    board, servo = _emulated(electronics, fault), WIRE_ORDER.index(fault.where)
    board.window.extend[servo] += way * round(fault.severity)
    board.nvs.store_extend(servo, board.window.extend[servo])


def _centre(electronics: EmulatedHand, fault: Injection, *, homes: bool) -> None:
    """Run CALIBRATE_MID on the board as if requested by another program, which took the acknowledgement."""
    board, servo = _emulated(electronics, fault), WIRE_ORDER.index(fault.where)

    def task() -> Task:
        yield from board.lock.take()
        yield from centre(board, servo)
        board.lock.give()
        if homes:
            yield from home(board)

    board.start(task())


def _emulated(electronics: EmulatedHand, fault: Injection) -> Board:
    if not isinstance(electronics.board, Board):
        raise ValueError(f"{fault} cannot be injected into a firmware program; leave out the program or the fault")
    return electronics.board


def _runs(version: str) -> Inject:
    def inject(assembly: HandAssembly, fault: Injection) -> Active:
        declared = assembly.firmware
        if version == declared:
            raise ValueError(f"a board that runs {version} as declared is no fault; declare another firmware")
        return Active(lambda: setattr(assembly, "firmware", version), lambda: assembly.flash(declared, assembly.side))

    return inject


def _wrong_side(assembly: HandAssembly, fault: Injection) -> Active:
    return Active(
        lambda: setattr(assembly, "board_side", OTHER_SIDE[assembly.side]),
        lambda: assembly.flash(assembly.firmware, assembly.side),
    )


# fmt: off
FAULTS = (
    Fault("board_restart", BOARD, Part.BOARD, "the board restarts",
          _event(_restart), at_s=5.0, alike=(Part.SUPPLY, Part.USB)),
    Fault("power_cycle", BOARD, Part.SUPPLY, "power is lost and returns",
          _event(lambda electronics, _: electronics.reset("power_on")), at_s=5.0, alike=(Part.BOARD, Part.USB)),
    Fault("board_hangs", BOARD, Part.BOARD, "board hang",
          _event(lambda electronics, _: electronics.board.stop(), _restart), at_s=5.0, alike=(Part.USB,)),
    Fault("nvs_lost", BOARD, Part.SETUP, "the board restarts without its stored zeros",
          _event(_forget), alike=(Part.BOARD,)),
    Fault("trim_left_in", BOARD, Part.SETUP, "the open end is trimmed away",
          _event(partial(_trim, way=1), partial(_trim, way=-1)), ALL, Severity("counts", (40, 120, 400), -2048, 2048)),
    Fault("calibrated_mid", BOARD, Part.SETUP,
          "CALIBRATE_MID moved a servo's zero, and the commands stay as they were",
          _event(partial(_centre, homes=False)), ALL, at_s=5.0),
    Fault("calibrated_mid_and_homed", BOARD, Part.SETUP,
          "CALIBRATE_MID, then HOMING, which undoes it; nothing is read meanwhile",
          _event(partial(_centre, homes=True)), ALL, at_s=5.0),
    # Part SETUP besides BOARD, because flashing the board and correcting the declared name both clear the fault.
    *(
        Fault(f"{RUNS}{version}", FaultLayer.FIRMWARE, Part.SETUP,
              f"the board runs {version}, another version than declared",
              _runs(version), later=False, excludes="version", alike=(Part.BOARD,))
        for version in FIRMWARE
    ),
    Fault("board_of_other_side", FaultLayer.FIRMWARE, Part.SETUP, "the firmware is that of the other hand",
          _wrong_side, later=False, alike=(Part.BOARD,)),
)
# fmt: on
