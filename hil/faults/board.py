"""Faults of the board: another firmware than declared, lost or wrong memory, restarts."""

from __future__ import annotations

from aero.channels import WIRE_ORDER
from aero.firmware import FIRMWARE
from firmware_emulator.firmware.board import Board
from firmware_emulator.firmware.calibrate_mid import centre
from firmware_emulator.firmware.hands import HandSide
from firmware_emulator.firmware.homing import home
from firmware_emulator.firmware.profiles import PROFILES
from firmware_emulator.hand import EmulatedHand
from firmware_emulator.kernel import Task
from hil.faults.assembly import Begin, HandAssembly, Injector, at_once
from hil.faults.fault import ALL, HOMED, ONCE, SWITCH, Fault, Kind

RUNS = "board_runs_"
"""Begins the name of a fault that says which version the board runs in truth."""
WRONG_SIDE = "board_of_other_side"
OTHER_SIDE: dict[HandSide, HandSide] = {"right": "left", "left": "right"}


def _runs(assembly: HandAssembly, fault: Fault) -> Begin:
    version = fault.name.removeprefix(RUNS)
    if version == assembly.firmware:
        raise ValueError(f"a board that runs {version} as declared is no fault; declare another firmware")
    return lambda: setattr(assembly, "firmware", version)


def _wrong_side(assembly: HandAssembly, fault: Fault) -> Begin:
    return lambda: setattr(assembly, "board_side", OTHER_SIDE[assembly.side])


def _restart(hand: EmulatedHand, fault: Fault) -> None:
    hand.reset("reset")


def _power_cycle(hand: EmulatedHand, fault: Fault) -> None:
    hand.reset("power_on")


def _hang(hand: EmulatedHand, fault: Fault) -> None:
    hand.board.stop()


def _forget(hand: EmulatedHand, fault: Fault) -> None:
    board = _emulated(hand, fault)
    for key, _ in board.nvs.items():
        board.nvs.forget(key)
    hand.reset("reset")


def _trim(hand: EmulatedHand, fault: Fault) -> None:
    assert fault.channel is not None
    board, servo = _emulated(hand, fault), WIRE_ORDER.index(fault.channel)
    board.window.extend[servo] += round(fault.severity)
    board.nvs.store_extend(servo, board.window.extend[servo])


def _centre(hand: EmulatedHand, fault: Fault) -> None:
    _under_lock(hand, fault, homes=False)


def _centre_and_home(hand: EmulatedHand, fault: Fault) -> None:
    _under_lock(hand, fault, homes=True)


def _under_lock(hand: EmulatedHand, fault: Fault, *, homes: bool) -> None:
    """Let the board do what another program has asked of it; its acknowledgement went there."""
    assert fault.channel is not None
    board, servo = _emulated(hand, fault), WIRE_ORDER.index(fault.channel)

    def task() -> Task:
        yield from board.lock.take()
        yield from centre(board, servo)
        board.lock.give()
        if homes:
            yield from home(board)

    board.start(task())


def _emulated(hand: EmulatedHand, fault: Fault) -> Board:
    if not isinstance(hand.board, Board):
        raise ValueError(f"{fault} cannot be put into a firmware program; leave out the program or the fault")
    return hand.board


KINDS = (
    *(
        Kind(
            f"{RUNS}{version}",
            "firmware",
            ("B8",),
            "",
            SWITCH,
            f"the board runs {version}, another version than declared",
            cause="version",
            bounds=ONCE,
            later=False,
            excludes="version",
            reason=FIRMWARE[version].looks_like,
        )
        for version in PROFILES
    ),
    Kind(
        WRONG_SIDE, "firmware", ("B7",), "", SWITCH, "the firmware is that of the other hand", bounds=ONCE, later=False
    ),
    Kind("board_restart", "firmware", ("B1",), "", SWITCH, "the board restarts", bounds=ONCE, at_s=5.0),
    Kind("power_cycle", "firmware", ("B1", "C9"), "", SWITCH, "power is lost and returns", bounds=ONCE, at_s=5.0),
    Kind("board_hangs", "firmware", ("B2",), "", SWITCH, "the board does nothing more", bounds=ONCE, at_s=5.0),
    Kind("nvs_lost", "firmware", ("B6",), "", SWITCH, "the board restarts without its stored zeros", bounds=ONCE),
    Kind(
        "trim_left_in",
        "firmware",
        ("B6",),
        "counts",
        (40, 120, 400),
        "the open end is trimmed away",
        ALL,
        reason=HOMED,
        bounds=(-2048, 2048),
    ),
    Kind(
        "calibrated_mid",
        "firmware",
        ("B6",),
        "",
        SWITCH,
        "CALIBRATE_MID moved a servo's zero, and the commands stay as they were",
        ALL,
        bounds=ONCE,
        at_s=5.0,
    ),
    Kind(
        "calibrated_mid_and_homed",
        "firmware",
        ("B6",),
        "",
        SWITCH,
        "CALIBRATE_MID, then HOMING, which undoes it; nothing is read meanwhile",
        ALL,
        bounds=ONCE,
        at_s=5.0,
        reason=HOMED,
    ),
)
BUILT_IN: dict[str, Injector] = {**{f"{RUNS}{version}": _runs for version in PROFILES}, WRONG_SIDE: _wrong_side}
INJECTORS: dict[str, Injector] = {
    "board_restart": at_once(_restart),
    "power_cycle": at_once(_power_cycle),
    "board_hangs": at_once(_hang),
    "nvs_lost": at_once(_forget),
    "trim_left_in": at_once(_trim),
    "calibrated_mid": at_once(_centre),
    "calibrated_mid_and_homed": at_once(_centre_and_home),
}
